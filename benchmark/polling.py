#!/usr/bin/env python3
"""Steps a second over ROS with polling before sleeping on and off, by turns, and what it costs.

    ./ws python3 benchmark/polling.py [--out FOLDER] [--seconds 2] [--rounds 8]

The cart-pole's environment in lock-step, with two simulators: for one LOCKSTEP_POLLING is 0 at both ends of
its connection. Only one is stepped at a time. For an idle machine with two cores or more: where more threads
want to run than there are cores, nothing is polled, and the ratio is 1. What waking a process costs on this
machine is measured as well (waking.py): a step has two such waits, and no more can be spared. Prints a table
and writes polling.json. It starts the simulators on masters of its own.
"""

import os
import statistics
import time
from contextlib import ExitStack
from dataclasses import dataclass, field

import reporting
import waking
from cartpole_world import add_cartpole
from realtime import processor_time, simulator_process

from cartpole.environment import CartPoleEnv
from cartpole.robot import ROBOT
from cartpole.tasks import BalanceTask
from robot_envs.backends.ros.lockstep import LockstepWorld
from robot_envs.backends.ros.shared_world import SharedWorld
from robot_envs.scene import Scene
from ros_calls.polling import SWITCH
from ros_utils.simulation import Simulation

TICKS = 8  # of an environment step
IDLE = 5.0  # [s] in which nobody steps
TARGETS = {"times as many": ">= 1.4", "cores": "<= 1", "idle": "0"}


@dataclass
class Pair:
    """A simulator and the environment that steps it."""

    simulation: Simulation
    env: CartPoleEnv
    simulator: int  # its process
    rates: list[float] = field(default_factory=list)  # [steps/s]
    shares: list[tuple[float, float]] = field(default_factory=list)  # cores: of client, simulator

    def turn(self, seconds: float) -> None:
        """Steps for a while."""
        with self.simulation.active():
            self.env.reset(seed=0)
            steps, begin = 0, time.perf_counter()
            client, simulator = time.process_time(), processor_time(self.simulator)
            while (passed := time.perf_counter() - begin) < seconds:
                _, _, terminated, truncated, _ = self.env.step(steps % 2)
                steps += 1
                if terminated or truncated:
                    self.env.reset()
            self.rates.append(steps / passed)
            self.shares.append(
                (
                    (time.process_time() - client) / passed,
                    (processor_time(self.simulator) - simulator) / passed,
                )
            )


def pair(polling: bool, stack: ExitStack) -> Pair:
    """Starts one; what is switched on or off holds for simulator and client."""
    os.environ[SWITCH] = str(int(polling))
    simulation = stack.enter_context(Simulation(lockstep=True))
    with simulation.active():
        add_cartpole()
        env = CartPoleEnv(BalanceTask(), LockstepWorld(Scene([ROBOT]), TICKS, SharedWorld()))
        env.reset(seed=0)  # it connects
        return Pair(simulation, env, simulator_process(simulation))


def idle(pairs: list[Pair]) -> list[float]:
    """Cores that are used while nobody steps: by this process, and by the simulators."""
    client, simulators = time.process_time(), [processor_time(each.simulator) for each in pairs]
    time.sleep(IDLE)
    used = [
        processor_time(each.simulator) - before
        for each, before in zip(pairs, simulators, strict=True)
    ]
    return [(time.process_time() - client) / IDLE, *(each / IDLE for each in used)]


def main() -> None:
    options = reporting.options(__doc__ or "", seconds=2.0, rounds=8)
    wake = waking.measured()  # first: it forks, and this process has no threads yet
    with ExitStack() as stack:
        pairs = {name: pair(name == "on", stack) for name in ("off", "on")}
        for each in pairs.values():
            each.turn(options.seconds)  # warms up
            each.rates.clear()
            each.shares.clear()
        for _ in range(options.rounds):
            for each in pairs.values():
                each.turn(options.seconds)
        client, *simulators = idle(list(pairs.values()))
    results = {
        name: {
            "steps/s": statistics.median(each.rates),
            "cores, client": max(client for client, _ in each.shares),
            "cores, simulator": max(simulator for _, simulator in each.shares),
        }
        for name, each in pairs.items()
    }
    ratios = [on / off for on, off in zip(pairs["on"].rates, pairs["off"].rates, strict=True)]
    print(
        f"{'polling':10} {'steps/s':>10} {'client':>8} {'simulator':>10}  (cores; target {TARGETS['cores']})"
    )
    for name, row in results.items():
        print(
            f"{name:10} {row['steps/s']:10.0f} {row['cores, client']:8.2f} {row['cores, simulator']:10.2f}"
        )
    print(
        f"on makes {statistics.median(ratios):.2f} times as many (target {TARGETS['times as many']}; "
        f"rounds: {', '.join(f'{ratio:.2f}' for ratio in ratios)})"
    )
    spared = 2.0 * wake * results["on"]["steps/s"]
    print(f"waking takes {1e6 * wake:.0f} us here: at most {1.0 + spared:.2f} times as many")
    print(
        f"idle: client {client:.3f}, simulators {' and '.join(f'{each:.3f}' for each in simulators)} cores "
        f"(target {TARGETS['idle']})"
    )
    reporting.write(
        options.out,
        "polling",
        {
            **results,
            "times as many": statistics.median(ratios),
            "waking": wake,
            "idle": {"client": client, "off": simulators[0], "on": simulators[1]},
        },
    )


if __name__ == "__main__":
    main()
