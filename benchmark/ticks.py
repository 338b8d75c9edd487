#!/usr/bin/env python3
"""What a tick of the simulator costs, against the engine's bare step of the same model.

    ./ws python3 benchmark/ticks.py [--out FOLDER] [--ticks 20000] [--rounds 9]

All figures of a round are taken one after the other, so that ratios are of one run; the table shows the
median round. Prints a table and writes ticks.json.
"""

import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any

import reporting

from robot_sim.control.controllers.base import Controller
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.manager import STRICT, ControllerManager
from robot_sim.control.transmissions import read_description
from robot_sim.physics.engines.bullet_engine import BulletEngine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World
from robot_sim.robot import ControlledRobot
from robot_sim.simulator import Simulator
from ros_utils import ros_urdf

GAINS = {"p": 100.0, "i": 0.01, "d": 10.0}
STATES = {"type": "joint_state_controller/JointStateController", "publish_rate": 120}
CART = {"type": "effort_controllers/JointPositionController", "joint": "stand_cart", "pid": GAINS}
TARGETS = {"tick with two controllers": 10.0, "JointPositionController update": 3.0}  # [us]
SHARE = 0.5  # of bare steps, in ticks with two controllers


def make_world(urdf: str, controllers: Mapping[str, Mapping[str, object]]) -> Simulator:
    """The cart-pole in a lock-step world, its controllers running and listened to."""
    sim = Simulator(World(BulletEngine()), lockstep=True)
    add_robot(sim, "cartpole", urdf, Pose(), controllers, _drop)
    return sim


def add_robot(
    sim: Simulator,
    name: str,
    urdf: str,
    pose: Pose,
    controllers: Mapping[str, Mapping[str, object]],
    listener: Callable[[Any], None] | None,
) -> None:
    """Puts a robot into the world; its controllers, if any, run."""
    model = sim.world.spawn(name, parse_urdf(urdf), pose)
    if controllers:
        hardware = RobotHardware(read_description(urdf))
        manager = ControllerManager(hardware)
        sim.add_robot(ControlledRobot(model, hardware, manager))
        for controller, params in controllers.items():
            for output in manager.load(controller, params).outputs:
                output.sink = listener
        manager.switch(list(controllers), [], STRICT)


def _drop(sample: tuple[object, ...]) -> None:
    """Stands for a listener."""


def per_call(action: Callable[[int], None], count: int) -> float:
    """Processor time of one of `count` calls' work [us]: other jobs count little then."""
    begin = time.thread_time()
    action(count)
    return 1e6 * (time.thread_time() - begin) / count


def steps(sim: Simulator) -> Callable[[int], None]:
    def run(count: int) -> None:
        for _ in range(count):
            sim.world.step()

    return run


def ticks(sim: Simulator) -> Callable[[int], None]:
    def run(count: int) -> None:
        with sim.lock:
            sim.advance(count)

    return run


def plain_loop(sim: Simulator) -> Callable[[int], None]:
    """What no general simulator in Python can beat: read, one line of control, write, step."""
    body = sim.world.models["cartpole"].body
    cart = body.joint_names.index("stand_cart")
    efforts = [0.0] * len(body.joint_names)

    def run(count: int) -> None:
        for _ in range(count):
            position, velocity, *_ = body.joint_states()[cart]
            efforts[cart] = -100.0 * position - 10.0 * velocity
            body.apply_efforts(efforts)
            sim.world.step()

    return run


def updates(controller: Controller) -> Callable[[int], None]:
    def run(count: int) -> None:
        for now in range(count):
            controller.update(now * 1_000_000, 0.001)

    return run


def measure(urdf: str, count: int, rounds: int) -> dict[str, float]:
    """Median costs [us] by what is measured."""
    both = make_world(urdf, {"states": STATES, "cart": CART})
    parts = {
        "bare step": steps(make_world(urdf, {})),
        "read, control, write, step": plain_loop(make_world(urdf, {})),
        "tick without a robot": ticks(make_world(urdf, {})),
        "tick with joint states": ticks(make_world(urdf, {"states": STATES})),
        "tick with two controllers": ticks(both),
        "JointPositionController update": updates(both.robots[0].manager.get("cart")),
        "JointStateController update": updates(both.robots[0].manager.get("states")),
    }
    taken: dict[str, list[float]] = {name: [] for name in parts}
    for _ in range(rounds):
        for name, action in parts.items():
            taken[name].append(per_call(action, count))
    return {name: statistics.median(values) for name, values in taken.items()}


def main() -> None:
    options = reporting.options(__doc__ or "", ticks=20_000, rounds=9)
    urdf = ros_urdf.urdf_parse_from_pkg("cartpole_gazebo", "cartpole_v1.urdf", "/robots") or ""
    costs = measure(urdf, options.ticks, options.rounds)
    bare = costs["bare step"]
    print(f"{'':34} {'us':>8} {'of bare':>8} {'target':>8}")
    for name, cost in costs.items():
        print(f"{name:34} {cost:8.2f} {bare / cost:8.0%} {TARGETS.get(name, ''):>8}")
    share = bare / costs["tick with two controllers"]
    print(f"ticks a second with two controllers: {1e6 / costs['tick with two controllers']:,.0f}, "
          f"{share:.0%} of bare steps (target {SHARE:.0%})")  # fmt: skip
    reporting.write(options.out, "ticks", {"microseconds": costs, "share": share})


if __name__ == "__main__":
    main()
