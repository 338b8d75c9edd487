"""One episode with a policy's random choice of actions, and the way back from a broken-off one."""

import random

import gymnasium
import numpy as np
import torch
from support.training.learning_fakes import POLE, run_episode

from rl_workbench.agents.reinforce import ReinforceAgent
from rl_workbench.training.episodes import EpisodeSource


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
