"""Puts everything that is replaced in place, for this process."""

from __future__ import annotations

import argparse
import os

import rospy

from lockstep_runner.nodes.followers import Followers
from lockstep_runner.replaced import (
    python_futures,
    python_locks,
    python_threads,
    python_time,
    ros_services,
    ros_time,
    ros_topics,
)
from lockstep_runner.runner import Runner
from lockstep_runner.simulation.world import World


def install(args: argparse.Namespace, world: World | None = None) -> Runner:
    """Replaces what docs/lockstep.md lists.

    Args:
        args: the launcher's options.
        world: for a node that follows the script's clock; None for the script's own process.

    Returns:
        What the replacements share.
    """
    triggers = None
    if args.step_on is not None:
        triggers = [_global(name) for name in args.step_on if name != "none"]
    runner = Runner(args.dt, triggers, world or World(args.seed))
    if world is None:
        followers = Followers(runner.notices)
        followers.passed = lambda: runner.clock.passed
        followers.forget_mail = runner.world.forget_mail
        runner.clock.others = followers
        runner.topics.follows = followers.has
    ros_topics.install(runner)
    ros_services.install(runner)
    ros_time.install(runner)
    python_threads.install(runner)
    python_locks.install(runner)
    python_futures.install(runner)
    python_time.install(runner, args.virtual_wall_clock)
    os.register_at_fork(after_in_child=runner.world.leave)
    rospy.core.add_shutdown_hook(lambda reason: runner.clock.release_all())
    return runner


def _global(name: str) -> str:
    return name if name.startswith("/") else f"/{name}"
