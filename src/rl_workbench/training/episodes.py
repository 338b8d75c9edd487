"""Collection of whole episodes: rounds of one episode per environment."""

from collections.abc import Callable, Generator, Sequence
from functools import partial
from typing import Any

import numpy as np

from rl_workbench.agents.document import PolicyGradientAgent
from rl_workbench.agents.policy_gradient import Episode
from rl_workbench.agents.reinforce import ReinforceAgent
from rl_workbench.states import generator_state, mark_random_states, rewind_random_states, set_generator
from rl_workbench.training.checked import BEGIN_STEP, CURVES, Env
from rl_workbench.training.environments import as_vector, succeeded

Agent = PolicyGradientAgent | ReinforceAgent


def play(
    env: Env,
    act: Callable[[np.ndarray], Any],
    limited: Callable[[Any], Any] = lambda action: action,
    begin: Callable[[Any], object] = lambda action: None,
) -> Generator[None, None, Episode]:
    """Plays one episode, and returns it. It yields before each step, so that others can be played meanwhile.

    `act` draws an action for an observation (D,), float32; `limited` is what the environment takes for it,
    and `begin` begins the step. The environment was seeded before.
    """
    episode = Episode()
    observation = as_vector(env.reset()[0])
    finished = False
    while not finished:
        action = act(observation)
        taken = limited(action)
        begin(taken)
        yield
        following, reward, terminated, truncated, info = env.step(taken)
        episode.add(observation, action, float(reward))
        observation = as_vector(following)
        finished = terminated or truncated
    episode.final_observation, episode.terminated = observation, bool(terminated)
    episode.success, episode.curves = succeeded(info), info.get(CURVES, {})
    return episode


def play_all(
    playing: list[Generator[None, None, Episode]], should_stop: Callable[[], bool]
) -> list[Episode] | None:
    """Plays what `play` returned of several environments, a step of each in turn, until all have ended.

    Returns the episodes in their order; None if `should_stop()`, called before each step, became true.
    """
    episodes: dict[int, Episode] = {}
    for each in playing:
        next(each)  # a policy acts at least once
    while len(episodes) < len(playing):
        for index, each in enumerate(playing):
            if index in episodes:
                continue
            if should_stop():
                return None
            try:
                next(each)
            except StopIteration as end:
                episodes[index] = end.value
    return [episodes[index] for index in range(len(playing))]


class EpisodeSource:
    """N environments, in each of which the same policy plays a whole episode.

    Environment i is seeded with the training's seed + i, and a generator of its own draws its actions (the
    agent's own for the first). So an episode depends on weights and generators only, not on the order in
    which episodes end. Where a step takes time in another process, all steps run at the same time.

    An episode that is interrupted has drawn from the generators, but nothing was learned from it. `rewind`
    takes its draws back, so that it can be played again as it would have been.
    """

    def __init__(self, envs: Sequence[Env], agent: Agent, seed: int) -> None:
        self._envs, self._agent, self._seed = envs, agent, seed
        others = [np.random.default_rng((seed, index)) for index in range(1, len(envs))]
        self._actions = [agent.generator, *others]

    def seed(self) -> None:
        """Seeds all environments, before their first episode."""
        for index, env in enumerate(self._envs):
            env.reset(seed=self._seed + index)

    def collect(self, should_stop: Callable[[], bool]) -> list[Episode] | None:
        """Plays one episode in each environment, in this order; None if `should_stop()` became true."""
        agent = self._agent
        # No one else waits while a single environment takes its step.
        begins: list[Callable[[Any], object]] = [lambda action: None]
        if len(self._envs) > 1:
            begins = [env.get_wrapper_attr(BEGIN_STEP) for env in self._envs]
        playing = [
            play(env, partial(agent.draw, generator=generator), agent.limited, begin)
            for env, generator, begin in zip(self._envs, self._actions, begins, strict=True)
        ]
        return play_all(playing, should_stop)

    def _generators(self) -> list[np.random.Generator]:
        # An environment has another generator after each seeding.
        return [*(each.unwrapped.np_random for each in self._envs), *self._actions]

    def mark(self) -> None:
        """Remembers where all generators are."""
        self._process = mark_random_states()
        self._states = [each.bit_generator.state for each in self._generators()]

    def rewind(self) -> None:
        """Brings the generators back to where `mark` found them."""
        rewind_random_states(self._process)
        for generator, state in zip(self._generators(), self._states, strict=True):
            generator.bit_generator.state = state

    def state(self) -> Any:
        """Returns the states of all generators but the agent's own: of one environment, or in lists."""
        environments = [generator_state(each.unwrapped.np_random) for each in self._envs]
        actions = [generator_state(each) for each in self._actions[1:]]
        return {"environments": environments, "actions": actions} if actions else environments[0]

    def load_state(self, state: Any) -> None:
        """Loads what `state` returned."""
        count = len(self._envs)
        texts = [state] if count == 1 else [*state["environments"], *state["actions"]]
        generators = self._generators()
        del generators[count]  # the agent's own
        for generator, text in zip(generators, texts, strict=True):
            set_generator(generator, text)
