#!/usr/bin/env python3
"""What a robot on two wheels costs: ticks against the engine's bare steps, twenty in a world, an environment.

    ./ws python3 benchmark/mobile.py [--out FOLDER] [--rounds 7] [--ticks 20000] [--seconds 5]

The rover of docs/robots.md drives in circles on Gazebo's ground plane, and nobody listens. Bare steps, ticks
with diff_drive_controller in this process, and ticks with diff_drive over ROS are measured by turns, as
processor time; ratios are medians over rounds. So are steps of Navigate-v0 and a loop by hand, which
on the same way sets the wheels' motors, makes as many bare steps, and casts the laser's rays by PyBullet's
rayTestBatch. Then twenty rovers run in real time on one core, and steps of Navigate-v0 are counted. Prints a
table and writes mobile.json. It starts simulators on masters of their own.
"""

import contextlib
import os
import statistics
import subprocess
import time
from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import pybullet
import reporting
from all_robots import BATCH, GENTLE, environment, rate
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from realtime import factor, processor_time, simulator_process
from ticks import STATES, add_robot, per_call, steps, ticks

from robot_envs.robots.driving import DriveToGoal
from robot_envs.robots.rover import ROBOT
from robot_sim.drives.wheels import side_speeds
from robot_sim.physics.engines.bullet_engine import BulletEngine
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from robot_sim.sensors.frames import frames
from robot_sim.sensors.laser import Laser
from robot_sim.sensors.sensing import sensor_pose
from robot_sim.simulator import Simulator
from ros_calls.service import ServiceClient
from ros_utils import ros_gazebo
from ros_utils.simulation import Simulation

NAVIGATE = "robot_envs/Navigate-v0"
CONTROL = '<plugin filename="libgazebo_ros_control.so" name="gazebo_ros_control"/>'
DRIVE = """<plugin name="drive" filename="libgazebo_ros_diff_drive.so">
<leftJoint>left_wheel</leftJoint><rightJoint>right_wheel</rightJoint>
<wheelSeparation>0.26</wheelSeparation><wheelDiameter>0.14</wheelDiameter></plugin>"""
AHEAD, TURN = 0.2, 0.5  # m/s, rad/s
WHEELS = {"left_wheel": 1.93, "right_wheel": 3.79}  # [rad/s] then
ROBOTS, APART = 20, 2.0  # APART in m
SIMULATORS = 4
WAY = 200  # steps of Navigate-v0, by turns with those by hand
TARGETS = {
    f"{NAVIGATE}, of a loop by hand": ">= 0.8",
    "of it, a tick with diff_drive": ">= 0.4",
    "of it, a tick with diff_drive_controller": ">= 0.4",
    f"{ROBOTS} rovers on one core, real-time factor": ">= 0.995",
    f"{ROBOTS} rovers on one core, what real time takes of it": "< 1",
}
Action = Callable[[int], None]


def rover(**controllers: dict[str, object]) -> Simulator:
    """A rover on the ground, its controllers running."""
    sim = Simulator(World(BulletEngine()), lockstep=True)
    sim.world.spawn("ground_plane", ground_plane(), Pose())
    add_robot(sim, "rover", ROBOT.xml, Pose(), controllers, listener=None)
    return sim


def bare() -> Action:
    """The engine alone, the wheels' motors on."""
    sim = rover()
    for joint, speed in WHEELS.items():
        sim.world.models["rover"].set_motor(joint, speed, 5.0)
    return steps(sim)


def controlled() -> Action:
    """Ticks with diff_drive_controller and joint states, in this process."""
    wheels = {**ROBOT.parameters["drive_controller"], "cmd_vel_timeout": 1e9}
    sim = rover(states=STATES, wheels=wheels)
    sim.robots[0].manager.get("wheels").command((AHEAD, 0.0, TURN))  # type: ignore[attr-defined]
    return ticks(sim)


@contextlib.contextmanager
def driven(robots: int, **launch: bool) -> Iterator[Simulation]:
    """A simulator over ROS with so many rovers, which diff_drive moves by one command."""
    with Simulation(**launch) as simulation, simulation.active():
        for index in range(robots):
            done = ros_gazebo.gazebo_spawn_urdf_string(
                ROBOT.xml.replace(CONTROL, DRIVE), model_name=f"rover{index}", pos_y=APART * index
            )
            assert done[0], done
        words = ["geometry_msgs/Twist", f"{{linear: {{x: {AHEAD}}}, angular: {{z: {TURN}}}}}"]
        subprocess.run(
            ["rostopic", "pub", "--once", "/cmd_vel", *words],
            env=simulation.environment(), check=True, stdout=subprocess.DEVNULL,
        )  # fmt: skip
        yield simulation


def tick_costs(count: int, rounds: int) -> dict[str, float]:
    """The processor time of a bare step [us], and its share of ticks."""
    with driven(1, lockstep=True) as simulation:
        step = ServiceClient("/gazebo/step_world", StepWorld, persistent=True, timeout=120.0)
        process, here = simulator_process(simulation), {"bare": bare(), "controller": controlled()}
        taken: dict[str, list[float]] = {"bare": [], "controller": [], "plugin": []}
        for _ in range(rounds + 1):
            for name, action in here.items():
                taken[name].append(per_call(action, count))
            begin = processor_time(process)
            assert step(StepWorldRequest(ticks=count)).success
            taken["plugin"].append(1e6 * (processor_time(process) - begin) / count)

    def share(name: str) -> float:
        pairs = zip(taken["bare"][1:], taken[name][1:], strict=True)  # the first warms up
        return statistics.median(a / b for a, b in pairs)

    return {
        "bare step of the rover [us]": statistics.median(taken["bare"][1:]),
        "of it, a tick with diff_drive": share("plugin"),
        "of it, a tick with diff_drive_controller": share("controller"),
    }


def _navigate() -> Any:
    return gymnasium.make(NAVIGATE).unwrapped


def navigation(rounds: int) -> dict[str, float]:
    """Processor time of a step of Navigate-v0 [ms], and its share of a step by hand."""
    env, other = _navigate(), _navigate()
    task: DriveToGoal = env.task
    env.action_space.seed(0)
    actions = [GENTLE * env.action_space.sample() for _ in range(WAY)]
    begins = {}  # poses of the rover, by the step before which it is put there

    def steps() -> None:
        env.reset(seed=0)
        for step, action in enumerate(actions, 1):
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
                begins[step] = env.state.models["rover"].pose

    steps()
    other.reset(seed=0)
    world = other.backend._sim.world
    rover, engine = world.models["rover"], world.engine
    sensor = next(each for each in rover.description.sensors if each.name == "laser")
    laser, ticks = Laser(sensor), round(ROBOT.control_period / world.time_step)
    ways, (fast, round_) = laser.directions.reshape(-1, 3), task.fastest

    def by_hand() -> None:
        for step, (ahead, turn) in enumerate(actions):
            if step in begins:
                rover.place(begins[step], ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
            speeds = side_speeds(0.5 * (ahead + 1.0) * fast, turn * round_, 0.26)
            for joint, speed in zip(WHEELS, speeds, strict=True):
                rover.set_motor(joint, speed / 0.07, 5.0)
            for _ in range(ticks):
                engine.step()
            turns, places = frames([sensor_pose(rover, sensor)])
            seen = ways @ turns[0].T
            ends = [(places[0] + reach * seen).tolist() for reach in (laser.low, laser.high)]
            pybullet.rayTestBatch(*ends, physicsClientId=engine._client)

    taken: dict[Callable[[], None], list[float]] = {steps: [], by_hand: []}
    for _ in range(rounds + 1):
        for action, times in taken.items():
            begin = time.process_time()
            action()
            times.append(1e3 * (time.process_time() - begin) / WAY)
    pairs = [*zip(*taken.values(), strict=True)][1:]  # the first warms up
    return {
        f"{NAVIGATE}, a step [ms]": statistics.median(own for own, _ in pairs),
        f"{NAVIGATE}, of a loop by hand": statistics.median(hand / own for own, hand in pairs),
    }


def in_real_time(seconds: float) -> dict[str, float]:
    """How rovers run in real time on one core."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})  # what is started from here on has no other
    try:
        with driven(ROBOTS) as simulation:
            found, share = factor(seconds, simulator_process(simulation))
    finally:
        os.sched_setaffinity(0, cores)
    name = f"{ROBOTS} rovers on one core, "
    return {f"{name}real-time factor": found, f"{name}what real time takes of it": share / found}


def vector() -> Callable[[], int]:
    """Steps of Navigate-v0 with simulators of their own; a batch is `BATCH` steps of all together."""
    envs = gymnasium.make_vec(NAVIGATE, SIMULATORS, backend="ros")
    envs.action_space.seed(0)
    actions = [GENTLE * envs.action_space.sample() for _ in range(BATCH)]
    envs.reset(seed=0)

    def batch() -> int:
        for action in actions:
            envs.step(action)
        return BATCH * SIMULATORS

    return batch


def environments(seconds: float) -> dict[str, float]:
    """Steps of Navigate-v0 by the clock on the wall [1/s]."""
    batches = {
        "in-process": environment(NAVIGATE),
        "over ROS": environment(NAVIGATE, backend="ros"),
        f"{SIMULATORS} simulators": vector(),
    }
    return {f"{NAVIGATE}, {name} [steps/s]": rate(batch, seconds).wall for name, batch in batches.items()}


def main() -> None:
    options = reporting.options(__doc__ or "", rounds=7, ticks=20_000, seconds=5.0)
    results = tick_costs(options.ticks, options.rounds)
    results |= navigation(options.rounds)
    results |= in_real_time(options.seconds)
    results |= environments(options.seconds)
    for name, value in results.items():
        print(f"{name:50} {value:9.2f} {TARGETS.get(name, ''):>8}")
    reporting.write(options.out, "mobile", results)


if __name__ == "__main__":
    main()
