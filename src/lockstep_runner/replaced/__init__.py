"""The replacements of the functions that docs/lockstep.md lists."""

import argparse
import os

import rospy

from lockstep_runner.replaced import python_time, ros
from lockstep_runner.runner import ScriptRunner
from lockstep_runner.world import ScriptWorld


def install(args: argparse.Namespace, world: ScriptWorld | None = None) -> ScriptRunner:
    """Replaces the functions that docs/lockstep.md lists, by the launcher's options; returns the runner."""
    triggers = None
    if args.step_on is not None:
        triggers = [f"/{name.removeprefix('/')}" for name in args.step_on if name != "none"]
    runner = ScriptRunner(args.dt, triggers, world or ScriptWorld(args.seed))
    ros.replace_topics(runner)
    ros.replace_services(runner)
    ros.replace_time(runner)
    python_time.replace_time(runner, args.virtual_wall_clock)
    os.register_at_fork(after_in_child=runner.world.leave)
    rospy.core.add_shutdown_hook(lambda reason: runner.clock.release_all())
    return runner
