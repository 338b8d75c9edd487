#!/usr/bin/env python3
"""Steps a second over ROS: in lock-step, and with the usual unpause / publish / wait / pause.

    ./ws python3 benchmark/step_service.py [--out FOLDER] [--steps 5000] [--rounds 5]

A step is 8 physics steps of 1 ms of the cart-pole with its two controllers. Prints tables and writes
lockstep.json. It starts simulators on masters of its own.
"""

import multiprocessing
import os
import statistics
import threading
import time
from collections.abc import Callable

import reporting
import rospy
from cartpole_world import CART, add_cartpole
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

from cartpole.environment import CartPoleEnv
from cartpole.robot import ROBOT
from cartpole.tasks import BalanceTask
from robot_envs.backends.ros.lockstep import LockstepWorld
from robot_envs.backends.ros.running import SharedWorld
from robot_envs.scene import Scene
from ros_utils.simulation import Simulation
from ros_utils.step_client import StepClient

TICKS = 8
ROBOTS = (1, 4, 16, 64)
SIMULATORS = (1, 2, 4)
TARGETS = {"environment": 4500.0, "ratio to the usual pattern": 15.0}


def rates(step: Callable[[int], object], count: int, rounds: int) -> float:
    """Median rate [1/s] of `count` steps in each of some rounds; the first one warms up."""
    found = []
    for _ in range(rounds + 1):
        begin = time.perf_counter()
        for index in range(count):
            step(index)
        found.append(count / (time.perf_counter() - begin))
    return statistics.median(found[1:])


def client_rate(robots: int, count: int, rounds: int, ready: Callable[[], object] = bool) -> float:
    """Steps a second through StepClient with so many robots in one world; `ready` waits for others."""
    with Simulation(lockstep=True) as simulation, simulation.active():
        for index in range(robots):
            add_cartpole(f"robot{index}", f"/robot{index}", pos_y=float(index))
        client = StepClient()
        names = [f"/robot{index}/{CART}" for index in range(robots)]
        client.reset()
        ready()
        return rates(
            lambda index: client.step(TICKS, dict.fromkeys(names, 0.02 * (index % 2))), count, rounds
        )


def environment_rate(count: int, rounds: int) -> float:
    """Environment steps a second, resets included."""
    with Simulation(lockstep=True) as simulation, simulation.active():
        add_cartpole()
        env = CartPoleEnv(BalanceTask(), LockstepWorld(Scene([ROBOT]), TICKS, SharedWorld()))
        env.reset(seed=0)

        def step(index: int) -> None:
            _, _, terminated, truncated, _ = env.step(index % 2)
            if terminated or truncated:
                env.reset()

        return rates(step, count, rounds)


def usual_rate(queue: "multiprocessing.Queue[float]", count: int, rounds: int) -> None:
    """Steps a second of a world in real time that is unpaused for each action, in a process of its own."""
    with Simulation(paused=True) as simulation, simulation.active():
        os.environ.update(simulation.environment())  # rospy knows one master
        rospy.init_node("usual_pattern", disable_rostime=True)
        add_cartpole()
        news = threading.Condition()
        stamps: list[rospy.Time] = []

        def receive(message: JointState) -> None:
            with news:
                stamps.append(message.header.stamp)
                news.notify_all()

        rospy.Subscriber("/joint_states", JointState, receive, tcp_nodelay=True)
        command = rospy.Publisher(f"/{CART}/command", Float64, queue_size=1)
        unpause = rospy.ServiceProxy("/gazebo/unpause_physics", Empty)
        pause = rospy.ServiceProxy("/gazebo/pause_physics", Empty)

        def step(index: int) -> None:
            with news:
                stamps.clear()
            unpause()
            command.publish(0.02 * (index % 2))
            with news:
                news.wait_for(lambda: stamps, 5.0)
            pause()

        queue.put(rates(step, count, rounds))


def parallel_rate(simulators: int, count: int, rounds: int) -> float:
    """Steps a second of several simulators together, each with a client process."""
    barrier = multiprocessing.Barrier(simulators)
    queue: multiprocessing.Queue[float] = multiprocessing.Queue()

    def work() -> None:
        queue.put(client_rate(1, count, rounds, barrier.wait))

    workers = [multiprocessing.Process(target=work) for _ in range(simulators)]
    for worker in workers:
        worker.start()
    total = sum(queue.get(timeout=600.0) for _ in workers)
    for worker in workers:
        worker.join()
    return total


def main() -> None:
    options = reporting.options(__doc__ or "", steps=5000, rounds=5)
    count, rounds = options.steps, options.rounds
    queue: multiprocessing.Queue[float] = multiprocessing.Queue()
    usual = multiprocessing.Process(target=usual_rate, args=(queue, max(50, count // 50), rounds))
    usual.start()
    results = {"usual pattern": queue.get(timeout=600.0)}
    usual.join()
    results["environment"] = environment_rate(count, rounds)
    results["ratio to the usual pattern"] = results["environment"] / results["usual pattern"]
    for robots in ROBOTS:
        results[f"client, {robots} robots"] = client_rate(robots, max(50, count // robots), rounds)
    for simulators in SIMULATORS[1:]:
        results[f"clients of {simulators} simulators"] = parallel_rate(simulators, count, rounds)
    print(f"{'steps of 8 ticks a second':40} {'rate':>10} {'target':>8}")
    for name, rate in results.items():
        print(f"{name:40} {rate:10.1f} {TARGETS.get(name, ''):>8}")
    reporting.write(options.out, "lockstep", results)


if __name__ == "__main__":
    main()
