"""Many own simulators on few cores get signals: bit-identical results, no process left."""

import os
import random
import signal
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.stress.scenario import Scenario

import cartpole  # noqa: F401 - registers the environments
from robot_envs.backends.backend import side_by_side

MANY = 16
STEPS = 400  # of each case, by each
HANG = 10.0  # [s] without an answer; those beside it need the processor, too
RATE = 0.02  # signals for each step of all
FATAL = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGSEGV)
OPTIONS = {"sensor_noise": 0.01, "randomisation": {"mass": 0.2, "length": 0.1}}


@pytest.mark.stress(full=True)
def test_signals_to_their_processes(scenario: Scenario) -> None:
    """Simulators and masters end in the middle of steps, or stop; each environment goes on as if alone."""
    restarts = []

    def case(number: int, dice: random.Random) -> None:
        with side_by_side(MANY):
            envs = [make(backend="ros-own", deadline=HANG) for _ in range(MANY)]
        processes = []
        try:
            twins = [make() for _ in range(MANY)]
            for index, (env, twin) in enumerate(zip(envs, twins, strict=True)):
                env.action_space.seed(1000 * number + index)
                assert np.array_equal(env.reset(seed=index)[0], twin.reset(seed=index)[0])
            for _ in range(STEPS):
                actions = [env.action_space.sample() for env in envs]
                for env, action in zip(envs, actions, strict=True):
                    env.begin_step(action)
                if dice.random() < RATE:
                    processes += hit(dice.choice(envs).backend.simulator, dice)
                for env, twin, action in zip(envs, twins, actions, strict=True):
                    (seen, *rest, _), (true, *others, _) = env.step(action), twin.step(action)
                    assert np.array_equal(seen, true)
                    assert rest == others
                    if rest[1] or rest[2]:
                        assert np.array_equal(env.reset()[0], twin.reset()[0])
        finally:
            processes += [pid for env in envs for pid in pids_of(env.backend.simulator)]
            with side_by_side(MANY):
                for env in envs:
                    env.close()
        restarts.append(sum(env.backend.restarts for env in envs))
        assert not [pid for pid in processes if Path(f"/proc/{pid}").exists()]

    row = scenario.run(f"{MANY} simulators of one's own, signals to them", 5, case)
    row.notes.append(f"{sum(restarts)} restarts")


def make(**options):
    return gymnasium.make("cartpole/Balance-v0", **OPTIONS, **options).unwrapped


def pids_of(simulator) -> list[int]:
    """The simulator's process, if it is known, and the supervisor's, which is the master."""
    return [*filter(None, [simulator.pid]), simulator._process.pid]


def hit(simulator, dice: random.Random) -> list[int]:
    """Sends a signal to one of the processes; returns all."""
    pids = pids_of(simulator)
    target = dice.choice(pids)
    stops = target == simulator.pid and dice.random() < 0.2
    os.kill(target, signal.SIGSTOP if stops else dice.choice(FATAL))
    return pids
