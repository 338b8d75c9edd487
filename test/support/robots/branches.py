"""Futures of a simulator, with and without a snapshot in between."""

from collections import deque
from dataclasses import is_dataclass

import numpy as np

from robot_sim.snapshot import Snapshot


def future(sim, ticks=150):
    """What a number of ticks leads to, tick by tick."""
    seen = []
    for _ in range(ticks):
        with sim.lock:
            sim.advance(1)
        models = sorted(sim.world.models.values(), key=lambda model: model.name)
        states = [(m.joint_states(), [m.link_state(link) for link in m.link_names]) for m in models]
        contacts = [each[:5] for each in sim.world.contacts()]
        robots = sorted(sim.robots, key=lambda robot: robot.model.name)
        efforts = [j.effort for r in robots for j in r.hardware.joints.values()]
        seen.append((sim.now, states, contacts, efforts))
    return seen


def check_plain(value):
    """Checks that a state is plain data: numbers, texts, arrays, and containers and records of these."""
    if isinstance(value, dict):
        value = [*value, *value.values()]
    elif is_dataclass(value):
        value = [getattr(value, name) for name in value.__dataclass_fields__]
    if isinstance(value, (list, tuple, deque)):
        for each in value:
            check_plain(each)
    else:
        assert isinstance(value, (type(None), bool, int, float, str, bytes, np.ndarray, np.generic))


def check_branches(sim, between, act=lambda: None, ticks=150):
    """Checks that the future is the same after `between`, in which anything happens."""
    with sim.lock:
        snapshot = sim.save_state()
    check_plain(snapshot.state)
    act()
    first = future(sim, ticks)
    for each in (snapshot, Snapshot.from_bytes(snapshot.to_bytes())):
        between()
        with sim.lock:
            sim.restore_state(each)
        act()
        assert future(sim, ticks) == first
    return first
