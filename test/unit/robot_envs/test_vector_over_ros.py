"""Vectors over ROS: a simulator for each robot, all at work at once, with the bits of worlds in-process."""

import os
import signal

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence as same
from gymnasium.vector import AutoresetMode
from support.robots.cartpole import RICH
from support.robots.pendulum import make_pendulum

import cartpole  # noqa: F401 - registers the environments
import robot_envs.robots  # noqa: F401 - the same of others
from robot_envs.vector import RobotVectorEnv

MODES, STEPS = ("NextStep", "SameStep", "Disabled"), 60


@pytest.fixture
def both():
    """A function that makes a vector over ROS, and one in this process."""
    made = []

    def make(identifier, **options):
        for backend in ("ros", "bullet"):
            made.append(gymnasium.make_vec(identifier, 2, backend=backend, **options))
        return made

    yield make
    for each in made:
        each.close()


class Recorded:
    """A backend that tells what is called."""

    def __init__(self, name, calls):
        self._inner = make_pendulum().backend
        self.scene, self.deterministic, self.shared = self._inner.scene, True, False
        self.look, self.reset, self.close = self._inner.look, self._inner.reset, self._inner.close
        self._name, self._calls = name, calls

    def begin(self, commands):
        self._calls.append(f"begin {self._name}")

    def act(self, commands):
        self._calls.append(f"act {self._name}")
        return self._inner.act(commands)


def test_all_steps_are_begun_before_the_first_one_is_taken():
    calls, names = [], iter("ab")

    def make(backend):
        assert backend == "ros-own"
        name = next(names)
        return make_pendulum(Recorded(name, calls), max_steps={"a": 2, "b": 5}[name])

    vector = RobotVectorEnv(2, make, backend="ros")
    vector.reset(seed=0)
    for expected in (["begin a", "begin b", "act a", "act b"],) * 2 + (["begin b", "act b"],):
        calls.clear()
        vector.step(np.zeros((2, 1), np.float32))
        assert calls == expected
    vector.close()


def rollout(vector, mode):
    vector.unwrapped.autoreset_mode = AutoresetMode(mode)
    vector.action_space.seed(3)
    given = [vector.reset(seed=5)]
    for _ in range(STEPS):
        given.append(vector.step(vector.action_space.sample()))
        ended = given[-1][2] | given[-1][3]
        if mode == "Disabled" and ended.any():
            given.append(vector.reset(options={"reset_mask": ended}))
    return given


@pytest.mark.slow
def test_two_simulators_give_the_bits_of_two_worlds_also_with_resets_apart(both):
    pictures = {"render_mode": "rgb_array", "width": 32, "height": 16}
    pair = both("cartpole/Classic-v0", max_steps=25, **pictures, **RICH)
    for mode in MODES:
        over_ros, here = (rollout(vector, mode) for vector in pair)
        ends = [row[2] | row[3] for row in here if len(row) == 5]
        assert any(one != other for one, other in ends), "they never end apart"
        assert all(same(a, b, exact=True) for a, b in zip(over_ros, here, strict=True)), mode
    pictures = [vector.render() for vector in pair]
    assert len(pictures[0]) == 2
    assert same(*pictures, exact=True)


@pytest.mark.slow
def test_a_simulator_that_dies_in_the_middle_costs_no_bit_and_none_is_left_in_the_end(both, caplog):
    """A robot of the user's kind, with observations that are dicts."""
    pair = both("robot_envs/TwoLinkReachGoal-v0")
    ours = pair[0].unwrapped.envs
    before = [env.backend.simulator.pid for env in ours]
    for vector in pair:
        vector.reset(seed=1)
        vector.action_space.seed(1)
    for step in range(20):
        if step == 9:
            os.kill(before[1], signal.SIGKILL)
        given = [vector.step(vector.action_space.sample()) for vector in pair]
        assert same(*given, exact=True), step
    assert [env.backend.restarts for env in ours] == [0, 1]
    assert "another one takes its place" in caplog.text
    pids = {*before, *(env.backend.simulator.pid for env in ours)}
    assert len(pids) == 3
    pair[0].close()
    assert not any(os.path.exists(f"/proc/{pid}") for pid in pids)
