#!/usr/bin/env python3
"""Steps a second of the robots that come along: in-process, over ROS, and as a loop on PyBullet alone.

    ./ws python3 benchmark/all_robots.py [--out FOLDER] [--seconds 2.0] [--rounds 5]

The loop is what a user writes who needs just this robot: PyBullet reads its URDF, and each tick of 1 ms
reads the joints, computes one line of control for each that is driven, writes and steps. A step is as many
ticks in all three; the environments' take in observation, reward and resets. The rates of a round are taken
one after the other; the table shows medians over rounds, also of the ratios. What is in one process is
measured by the processor's time, so that it counts little what else the machine does. Prints a table and
writes all_robots.json.
"""

import contextlib
import multiprocessing
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import reporting

import robot_envs.robots  # noqa: F401 - registers the environments
from robot_envs.making import named
from robot_envs.robot import Robot
from robot_sim.physics.engines.quiet_pybullet import pybullet

TARGET = 0.45  # of the loop's rate
BATCH = 50  # steps between looks at the clock
GENTLE = 0.2  # of the actions: nothing falls over


class Loop(NamedTuple):
    """How a robot is driven by hand: the joints, and a gain for each."""

    joints: tuple[str, ...]
    stiffness: tuple[float, ...] = ()  # [N m/rad]
    damping: tuple[float, ...] = ()  # [N m s/rad]
    at: tuple[float, ...] = ()  # [rad]; where they are held


LOOPS = {
    "robot_envs/TwoLinkReach-v0": Loop(("shoulder", "elbow"), (0.0, 0.0), (2.0, 0.5), (0.0, 0.0)),
    "robot_envs/SixJointReach-v0": Loop(
        ("waist", "shoulder", "elbow", "forearm_roll", "wrist_pitch", "hand_roll")
    ),
    "robot_envs/Furuta-v0": Loop(("arm_joint",), (0.0,), (0.0,), (0.0,)),
    "robot_envs/DoublePendulum-v0": Loop(("cart_joint",), (0.0,), (0.0,), (0.0,)),
    "robot_envs/Hopper-v0": Loop(
        ("hip", "knee", "ankle"), (120.0, 120.0, 60.0), (3.0, 3.0, 1.0), (-0.45, 0.9, -0.45)
    ),
}
HEIGHTS = {"robot_envs/Hopper-v0": -0.05}  # [m] of the joint "up" at the begin: the foot is on the ground


class Rate(NamedTuple):
    """Steps [1/s] by the clock on the wall, and by the time that this process has had a processor."""

    wall: float
    processor: float


def rate(batch: Callable[[], int], seconds: float) -> Rate:
    """What calls of `batch` do, each of which returns how many steps it did."""
    batch()  # warms up
    steps, begin, used = 0, time.perf_counter(), time.process_time()
    while (passed := time.perf_counter() - begin) < seconds:
        steps += batch()
    return Rate(steps / passed, steps / (time.process_time() - used))


def environment(identifier: str, **options: Any) -> Callable[[], int]:
    """Small random actions."""
    env = gymnasium.make(identifier, **options).unwrapped
    env.action_space.seed(0)
    actions = [GENTLE * env.action_space.sample() for _ in range(BATCH)]
    env.reset(seed=0)

    def batch() -> int:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return BATCH

    return batch


def by_hand(identifier: str) -> Callable[[], int]:
    """The robot in PyBullet, driven by a loop."""
    robot: Robot = named(gymnasium.registry[identifier].kwargs["robot"])
    loop, ticks = LOOPS[identifier], round(robot.control_period / 0.001)
    client = pybullet.connect(pybullet.DIRECT)
    call: dict[str, Any] = {"physicsClientId": client}
    pybullet.setGravity(0.0, 0.0, -9.8, **call)
    pybullet.setTimeStep(0.001, **call)
    pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE, **call), **call)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "robot.urdf")
        path.write_text(robot.xml, encoding="utf-8")
        flags = pybullet.URDF_MERGE_FIXED_LINKS
        with _silent():
            body = pybullet.loadURDF(str(path), useFixedBase=True, flags=flags, **call)
    names = [
        pybullet.getJointInfo(body, index, **call)[1].decode()
        for index in range(pybullet.getNumJoints(body, **call))
    ]
    for index, name in enumerate(names):  # PyBullet brakes each joint, unless told otherwise
        pybullet.setJointMotorControl2(body, index, pybullet.VELOCITY_CONTROL, force=0.0, **call)
        start = dict(zip(loop.joints, loop.at, strict=False)).get(name, 0.0)
        pybullet.resetJointState(body, index, HEIGHTS.get(identifier, 0.0) if name == "up" else start, **call)
    driven = [names.index(name) for name in loop.joints]
    every = list(range(len(names)))
    step = _torques(loop, body, every, driven, call) if loop.at else _positions(body, every, driven, call)

    def batch() -> int:
        for _ in range(BATCH * ticks):
            step()
        return BATCH

    return batch


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """PyBullet tells what it makes of a file, from C."""
    sys.stdout.flush()
    before = os.dup(1)
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(before, 1)
        os.close(before)


def _torques(
    loop: Loop, body: int, every: Sequence[int], driven: Sequence[int], call: dict[str, Any]
) -> Callable[[], None]:
    gains = list(zip(driven, loop.stiffness, loop.damping, loop.at, strict=True))

    def step() -> None:
        states = pybullet.getJointStates(body, every, **call)
        forces = [k * (at - states[i][0]) - d * states[i][1] for i, k, d, at in gains]
        pybullet.setJointMotorControlArray(body, driven, pybullet.TORQUE_CONTROL, forces=forces, **call)
        pybullet.stepSimulation(**call)

    return step


def _positions(
    body: int, every: Sequence[int], driven: Sequence[int], call: dict[str, Any]
) -> Callable[[], None]:
    def step() -> None:
        states = pybullet.getJointStates(body, every, **call)
        wanted = [0.999 * states[index][0] for index in driven]
        pybullet.setJointMotorControlArray(
            body, driven, pybullet.POSITION_CONTROL, targetPositions=wanted, **call
        )
        pybullet.stepSimulation(**call)

    return step


def measure(identifier: str, seconds: float, rounds: int) -> dict[str, list[Rate]]:
    """Rates of the rounds: by hand, in-process, over ROS."""
    batches = {
        "by hand": by_hand(identifier),
        "in-process": environment(identifier),
        "over ROS": environment(identifier, backend="ros"),
    }
    taken: dict[str, list[Rate]] = {name: [] for name in batches}
    for _ in range(rounds):
        for name, batch in batches.items():
            taken[name].append(rate(batch, seconds))
    return taken


def figures(taken: dict[str, list[Rate]]) -> dict[str, float]:
    """Medians over the rounds."""
    hand, here, ros = taken["by hand"], taken["in-process"], taken["over ROS"]
    return {
        "by hand": statistics.median(each.processor for each in hand),
        "in-process": statistics.median(each.processor for each in here),
        "in-process / by hand": statistics.median(
            a.processor / b.processor for a, b in zip(here, hand, strict=True)
        ),
        "over ROS": statistics.median(each.wall for each in ros),
        "over ROS / in-process": statistics.median(a.wall / b.wall for a, b in zip(ros, here, strict=True)),
    }


def main() -> None:
    chosen = reporting.options(__doc__ or "", seconds=2.0, rounds=5)
    results = {}
    print(f"{'steps a second':30} {'by hand':>9} {'in-process':>11} {'of it':>6} {'over ROS':>9} "
          f"{'of in-process':>14}")  # fmt: skip
    for identifier in LOOPS:
        # In a process of its own, which moves one world over ROS at a time.
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            taken = pool.apply(measure, (identifier, chosen.seconds, chosen.rounds))
        hand, here, share, ros, over = figures(taken).values()
        results[identifier] = figures(taken)
        print(f"{identifier:30} {hand:9,.0f} {here:11,.0f} {share:6.0%} {ros:9,.0f} {over:14.0%}")
    print(f"target: in-process {TARGET:.0%} of the loop by hand")
    reporting.write(chosen.out, "all_robots", results)


if __name__ == "__main__":
    main()
