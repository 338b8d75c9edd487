#!/usr/bin/env python3
"""Many robots in one world, against the engine's bare steps of the same robots.

    ./ws python3 benchmark/many_robots.py [--out FOLDER] [--rounds 5] [--seconds 0.2]

Cart-poles with their two controllers on Gazebo's ground plane, two metres from each other. Ratios are of one
run: what is compared is measured by turns, and each figure is the median over rounds. In this process it is
the processor's time that counts, over ROS the clock's, of an idle machine then. The last part has the
simulator run in real time, on one core. Prints tables and writes many_robots.json. It starts simulators on
masters of its own.
"""

import contextlib
import os
import statistics
import time
from collections.abc import Callable, Iterator, Mapping

import reporting
from cartpole_world import CART, add_cartpole
from realtime import factor, simulator_process
from ticks import CART as CART_PARAMS
from ticks import STATES, add_robot

from robot_sim.physics.engines.bullet_engine import BulletEngine
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from robot_sim.simulator import Simulator
from ros_utils import ros_urdf
from ros_utils.simulation import Simulation
from ros_utils.step_client import StepClient

ROBOTS = (1, 8, 32, 64, 256)
CALLS = (1, 20)  # ticks of one call of step_world
TARGET, TARGET_ROBOTS = 0.40, 64  # of bare steps
LEAN = 0.5  # [rad] of the poles at first: they swing
REAL_TIME_ROBOTS = 32
REAL_TIME = 10.0  # [s]
APART = 2.0  # [m]
HEIGHT = 1.0  # [m] above the ground, which a pole would touch that falls
Action = Callable[[int], None]  # does so many ticks


def rate(action: Action, ticks: int, clock: Callable[[], float], seconds: float) -> float:
    """Ticks [1/s] of calls of `action`, each for `ticks`, in `seconds` by `clock`."""
    done, begin = 0, clock()
    while (passed := clock() - begin) < seconds:
        action(ticks)
        done += ticks
    return done / passed


def by_turns(
    actions: dict[str, tuple[Action, int]], clock: Callable[[], float], rounds: int, seconds: float
) -> dict[str, float]:
    """Median rates [ticks/s] of actions, each with the ticks of a call; the first round warms up."""
    taken: dict[str, list[float]] = {name: [] for name in actions}
    for _ in range(rounds + 1):
        for name, (action, ticks) in actions.items():
            taken[name].append(rate(action, ticks, clock, seconds))
    return {name: statistics.median(values[1:]) for name, values in taken.items()}


def make_world(urdf: str, robots: int, controllers: Mapping[str, Mapping[str, object]]) -> Simulator:
    """As in `empty_world.launch`, with so many cart-poles; no one listens."""
    sim = Simulator(World(BulletEngine()), lockstep=True)
    sim.world.spawn("ground_plane", ground_plane(), Pose())
    for index in range(robots):
        pose = Pose((0.0, APART * index, HEIGHT))
        add_robot(sim, f"robot{index}", urdf, pose, controllers, listener=None)
    for model in list(sim.world.models.values())[1:]:
        sim.set_joint_states(model, {"cart_pole": LEAN})
    return sim


def bare(urdf: str, robots: int) -> Action:
    """The engine alone."""
    step = make_world(urdf, robots, {}).world.engine.step

    def run(count: int) -> None:
        for _ in range(count):
            step()

    return run


def ticking(urdf: str, robots: int) -> Action:
    """The simulator in this process."""
    sim = make_world(urdf, robots, {"states": STATES, "cart": CART_PARAMS})

    def run(count: int) -> None:
        with sim.lock:
            sim.advance(count)

    return run


def in_process(urdf: str, rounds: int, seconds: float) -> dict[int, dict[str, float]]:
    """Rates [ticks/s] by number of robots."""
    found = {}
    for robots in ROBOTS:
        actions = {"bare": (bare(urdf, robots), 10), "tick": (ticking(urdf, robots), 10)}
        found[robots] = by_turns(actions, time.thread_time, rounds, seconds)
    return found


@contextlib.contextmanager
def simulator(robots: int, **launch: bool) -> Iterator[Simulation]:
    """A running simulator with so many cart-poles under control."""
    with Simulation(**launch) as simulation, simulation.active():
        for index in range(robots):
            add_cartpole(f"robot{index}", f"/robot{index}", pos_y=APART * index, pos_z=HEIGHT)
        yield simulation


def over_ros(urdf: str, rounds: int, seconds: float) -> dict[int, dict[str, float]]:
    """Rates [ticks/s] in lock-step, one request with commands for all robots; by number of robots."""
    found = {}
    for robots in ROBOTS:
        with simulator(robots, lockstep=True):
            client = StepClient()
            client.reset({f"robot{i}::cart_pole": LEAN for i in range(robots)})
            commands = [dict.fromkeys((f"/robot{i}/{CART}" for i in range(robots)), x) for x in (0.0, 0.02)]
            calls = 0

            def step(ticks: int) -> None:
                nonlocal calls
                calls += 1
                client.step(ticks, commands[calls % 2])  # noqa: B023 - called in this round only

            actions = {"bare": (bare(urdf, robots), 10)} | {
                f"{ticks} ticks a call": (step, ticks) for ticks in CALLS
            }
            found[robots] = by_turns(actions, time.perf_counter, rounds, seconds)
    return found


def in_real_time(robots: int) -> tuple[float, float]:
    """The real-time factor on one core, and the share of it that is used."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})  # what is started from here on has no other
    try:
        with simulator(robots) as simulation:
            return factor(REAL_TIME, simulator_process(simulation))
    finally:
        os.sched_setaffinity(0, cores)


def show(title: str, rates: dict[int, dict[str, float]]) -> None:
    print(f"{title:36} {'us a robot':>10} {'ticks/s':>9} {'of bare':>8} {'target':>7}")
    for robots, found in rates.items():
        for name, value in found.items():
            aim = f"{TARGET:7.0%}" if robots == TARGET_ROBOTS and name != "bare" else ""
            each = 1e6 / value / robots
            line = f"{robots} robots, {name}"
            print(f"{line:36} {each:10.2f} {value:9,.0f} {value / found['bare']:8.0%} {aim}")


def main() -> None:
    chosen = reporting.options(__doc__ or "", rounds=5, seconds=0.2)
    urdf = ros_urdf.urdf_parse_from_pkg("cartpole_gazebo", "cartpole_v1.urdf", "/robots") or ""
    ticks = in_process(urdf, chosen.rounds, chosen.seconds)
    show("in this process", ticks)
    steps = over_ros(urdf, chosen.rounds, chosen.seconds)
    show("lock-step over ROS", steps)
    found, share = in_real_time(REAL_TIME_ROBOTS)
    print(f"{REAL_TIME_ROBOTS} robots in real time on one core: factor {found:.3f} (target 1), "
          f"{share:.2f} of the core")  # fmt: skip
    reporting.write(
        chosen.out,
        "many_robots",
        {
            "ticks_per_second": {"in process": ticks, "over ROS": steps},
            "real_time": {"robots": REAL_TIME_ROBOTS, "factor": found, "share": share},
        },
    )


if __name__ == "__main__":
    main()
