"""One episode with a policy's random choice of actions, and the way back from, and into, a broken-off one."""

import json
import random
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from support.training.goal_environments import REACH
from support.training.learning_fakes import POLE, run_episode

from rl_workbench.agents.reinforce import ReinforceAgent
from rl_workbench.training.environments import as_vector, make_environment
from rl_workbench.training.episodes import EpisodeSource
from rl_workbench.training.repeatable import RepeatableEnvironment


def pole(**options: object) -> gymnasium.Env:
    return gymnasium.make(POLE, **options)


def test_it_tells_how_the_episode_ended() -> None:
    episode = run_episode(pole(), ReinforceAgent(0))
    assert episode.terminated and episode.length == len(episode.states()) - 1
    assert episode.final_observation.shape == (4,)
    short = run_episode(pole(max_episode_steps=3), ReinforceAgent(0))
    assert not short.terminated and short.length == 3


def test_one_that_is_broken_off_is_dropped() -> None:
    asked = iter([False, False, True])
    assert run_episode(pole(), ReinforceAgent(0), lambda: next(asked)) is None


def test_observations_are_kept_that_an_environment_writes_over() -> None:
    class Writing(gymnasium.ObservationWrapper):
        def observation(self, observation):
            self.array = getattr(self, "array", observation.copy())
            self.array[:] = observation
            return self.array

    plain, written = (run_episode(each, ReinforceAgent(0)) for each in (pole(), Writing(pole())))
    assert np.array_equal(plain.states(), written.states())


def test_what_was_drawn_is_taken_back() -> None:
    def draw() -> list[float]:
        found = [random.random(), np.random.random(), torch.rand(1).item()]
        return [*found, env.unwrapped.np_random.random(), agent.generator.random()]

    env, agent = pole(noise=0.05), ReinforceAgent(5)
    env.reset(seed=3)
    generators = EpisodeSource([env], agent, 3)
    generators.mark()
    first = draw()
    generators.rewind()
    assert draw() == first
    generators.mark()
    assert draw() != first


def test_an_environment_that_was_seeded_anew_comes_back_too() -> None:
    env, agent = pole(noise=0.05), ReinforceAgent(5)
    env.reset(seed=3)
    generators = EpisodeSource([env], agent, 3)
    state = generators.state()
    wanted = env.reset()[0]
    env.reset(seed=4)
    generators.load_state(state)
    assert np.array_equal(env.reset()[0], wanted)


# Back into the middle of an episode: its start and its actions, taken once more.


def made(seed: int = 3, env_id: str = POLE, **options: Any) -> RepeatableEnvironment:
    options = options or {"noise": 0.05}
    env = RepeatableEnvironment(make_environment(env_id, options, keep_dict=True))
    env.reset(seed=seed)
    env.action_space.seed(seed)
    return env


@pytest.mark.parametrize(
    ("env_id", "options"), [(POLE, {"noise": 0.05}), (REACH, {"joints": 2}), (REACH, {"moves": 4})]
)
@pytest.mark.parametrize("is_first", [False, True])
@pytest.mark.parametrize("steps", [0, 1, 7])
def test_another_environment_comes_to_the_same_place(env_id, options, is_first, steps) -> None:
    one, other = made(3, env_id, **options), made(4, env_id, **options)
    for _ in range(0 if is_first else 3):
        observation, _ = one.reset()
    for _ in range(steps):
        observation, *_ = one.step(one.action_space.sample())
    found = other.load_state_dict(one.state_dict())
    assert found is not None and other.length == one.length == steps
    if steps:
        assert np.array_equal(found, as_vector(observation))
    for action in [one.action_space.sample() for _ in range(3)]:
        mine, theirs = one.step(action), other.step(action)
        assert np.array_equal(as_vector(mine[0]), as_vector(theirs[0])) and mine[1:] == theirs[1:]
    after = as_vector(one.reset()[0]), as_vector(other.reset()[0])
    assert np.array_equal(*after), "the episode after it is the same, too"


def test_what_is_done_inside_is_no_part_of_the_episode() -> None:
    place = made()
    place.reset()
    place.step(1)
    before, state = place.generator, place.state_dict()
    place.env.reset(seed=99)
    for _ in range(5):
        place.env.step(0)
    place.generator = before
    assert place.length == 1
    assert np.array_equal(place.load_state_dict(state), state["observation"].numpy())
    assert json.loads(place.generator) == json.loads(before)


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
