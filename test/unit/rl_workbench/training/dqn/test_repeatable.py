"""The way back into the middle of an episode: its start and its actions, taken once more."""

import json

import gymnasium
import numpy as np
import pytest
from learning_fakes import POLE, Dicing

from rl_workbench.training.dqn.repeatable import RepeatableEnvironment
from rl_workbench.training.run.environments import make_environment


def made(seed: int = 3) -> RepeatableEnvironment:
    return RepeatableEnvironment(make_environment(POLE, {"noise": 0.05}), seed)


@pytest.mark.parametrize("steps", [0, 1, 7])
def test_another_environment_comes_to_the_same_place(steps: int) -> None:
    one, other = made(), made(4)
    for _ in range(3):
        one.reset()
    for index in range(steps):
        observation, *_ = one.step(index % 2)
    found = other.load_state_dict(one.state_dict())
    other.generator = one.generator
    assert found is not None and other.length == one.length == steps
    if steps:
        assert np.array_equal(found, observation)
    for action in (1, 1, 0):
        mine, theirs = one.step(action), other.step(action)
        assert np.array_equal(mine[0], theirs[0]) and mine[1:] == theirs[1:]
    assert np.array_equal(one.reset(), other.reset()), "the episode after it is the same, too"


def test_one_that_goes_another_way_is_told(monkeypatch) -> None:
    """And its generator is as if nothing had been tried."""
    for spoil in ("observation", "length", "spec"):
        one, other = made(), made()
        one.reset()
        for action in (0, 1, 1):
            one.step(action)
        state, before = one.state_dict(), other.generator
        if spoil == "observation":
            state["observation"] += 1
        if spoil == "length":  # it ends before all actions were taken
            state["actions"] = state["actions"].new_zeros(500)
        if spoil == "spec":
            monkeypatch.setattr(gymnasium.registry[POLE], "nondeterministic", True)
            other = made()
        assert other.load_state_dict(state) is None
        assert json.loads(other.generator) == json.loads(before)


def test_an_environment_that_writes_over_its_observations() -> None:
    class Writing(gymnasium.ObservationWrapper):
        array = np.zeros(4, np.float32)

        def observation(self, observation):
            self.array[:] = observation
            return self.array

    place = RepeatableEnvironment(Writing(make_environment(POLE)), 0)
    first = place.reset()
    second, *_ = place.step(1)
    assert first.tolist() == [0.0] * 4 and second.any() and second.dtype == np.float32


def test_one_that_draws_from_others_generators_goes_another_way() -> None:
    place = RepeatableEnvironment(Dicing(), 0)
    place.reset()
    state = place.state_dict()
    assert place.load_state_dict(state) is None
