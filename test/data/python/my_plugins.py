"""Plugins of a user's own (docs/plugins.md)."""

import sys


class BreaksTheWorld:
    """Gets itself into a tick where nothing is caught: a fault of the simulator's own."""

    def __init__(self, context):
        with context.sim.lock:
            context.sim.listeners = [*context.sim.listeners, lambda now: sys.exit("out of a tick")]

    def shutdown(self):
        pass
