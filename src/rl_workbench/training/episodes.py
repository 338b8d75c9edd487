"""Where the episodes come from that a policy gradient learns from: rounds of one from each environment."""

from collections.abc import Callable, Generator, Sequence
from functools import partial
from typing import Any, Protocol

import gymnasium
import numpy as np

from rl_workbench.agents.document import Episode, PolicyGradientAgent
from rl_workbench.agents.reinforce import ReinforceAgent
from rl_workbench.training.checked import BEGIN_STEP
from rl_workbench.training.environments import as_vector, close_all, succeeded
from rl_workbench.training.generators import EpisodeGenerators, action_generator

Agent = PolicyGradientAgent | ReinforceAgent


class EpisodeSource(Protocol):
    """N environments, in which the same policy plays a whole episode each.

    The environment i is seeded by the training's seed + i, and its actions are drawn by a generator of its
    own (`action_generator`; the agent's for the first one). So what an episode comes to depends on weights
    and generators only, wherever it is played, and in whatever order they end.
    """

    def seed(self) -> None:
        """Seeds all environments, before their first episode.

        Raises:
            WorkbenchError: if one fails, with its number if there are several.
        """
        ...

    def collect(self, should_stop: Callable[[], bool]) -> list[Episode] | None:
        """One episode from each environment, all by the agent's policy as it is now.

        Args:
            should_stop: is asked again and again, while episodes are played.

        Returns:
            The episodes in the order of the environments; None if `should_stop()` became true.

        Raises:
            WorkbenchError: as `seed`.
        """
        ...

    def mark(self) -> None:
        """Remembers where all generators are."""
        ...

    def rewind(self) -> None:
        """Brings them back to where `mark` found them: what was drawn since then is taken back."""
        ...

    def state(self) -> Any:
        """Where the generators are, but for the agent's own, as plain values.

        That of N environments is the same, whatever source they are of: see `EpisodeGenerators.state`.
        """
        ...

    def load_state(self, state: Any) -> None:
        """Takes over what `state` gave.

        Raises:
            TypeError, ValueError, LookupError: if it gave something else.
        """
        ...

    def close(self) -> None:
        """Closes all environments."""
        ...


class LocalEpisodes:
    """Environments in this process: a step of each in turn.

    Where a step's work is done elsewhere, as in simulators, it is done for all of them at the same time.

    Args:
        envs: each with a robot of its own.
        agent: plays in them.
        seed: of the training.
    """

    def __init__(self, envs: Sequence[gymnasium.Env[Any, Any]], agent: Agent, seed: int) -> None:
        self._envs, self._agent, self._seed = envs, agent, seed
        others = [action_generator(seed, index) for index in range(1, len(envs))]
        self._actions = [agent.generator, *others]
        self._generators = EpisodeGenerators(envs, self._actions)

    def seed(self) -> None:
        """See `EpisodeSource`."""
        for index, env in enumerate(self._envs):
            env.reset(seed=self._seed + index)

    def collect(self, should_stop: Callable[[], bool]) -> list[Episode] | None:
        """See `EpisodeSource`."""
        agent = self._agent
        playing = [
            play(env, partial(agent.draw, generator=generator), agent.limited, begin)
            for env, generator, begin in zip(self._envs, self._actions, self._begins(), strict=True)
        ]
        return play_all(playing, should_stop)

    def _begins(self) -> list[Callable[[Any], object]]:
        """What has a step begin in each; nothing in a single one, which nobody else is waited for with."""
        if len(self._envs) == 1:
            return [lambda action: None]
        return [env.get_wrapper_attr(BEGIN_STEP) for env in self._envs]

    def mark(self) -> None:
        """See `EpisodeSource`."""
        self._generators.mark()

    def rewind(self) -> None:
        """See `EpisodeSource`."""
        self._generators.rewind()

    def state(self) -> Any:
        """See `EpisodeSource`."""
        return self._generators.state()

    def load_state(self, state: Any) -> None:
        """See `EpisodeSource`."""
        self._generators.load_state(state)

    def close(self) -> None:
        """See `EpisodeSource`."""
        close_all(self._envs)


def play(
    env: gymnasium.Env[Any, Any],
    act: Callable[[np.ndarray], Any],
    limited: Callable[[Any], Any] = lambda action: action,
    begin: Callable[[Any], object] = lambda action: None,
) -> Generator[None, None, Episode]:
    """Plays one episode; stops before each step, so that others can be played meanwhile.

    Args:
        env: was seeded before.
        act: draws an action for an observation (D,), float32.
        limited: makes of an action that was drawn the one that the environment takes.
        begin: has the step by such an action begin, before this stops.

    Returns:
        The episode.
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
    episode.success = succeeded(info)
    return episode


def play_all(
    playing: list[Generator[None, None, Episode]], should_stop: Callable[[], bool]
) -> list[Episode] | None:
    """Plays several episodes at the same time, a step of each in turn, until all have ended.

    Args:
        playing: what `play` gave, of environments of their own.
        should_stop: is asked before each step.

    Returns:
        The episodes, in their order, or None if they were broken off because `should_stop()` became true.
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


def run_episode(
    env: gymnasium.Env[Any, Any],
    act: Callable[[np.ndarray], Any],
    should_stop: Callable[[], bool],
    limited: Callable[[Any], Any] = lambda action: action,
) -> Episode | None:
    """Runs one episode alone; see `play` and `play_all`."""
    episodes = play_all([play(env, act, limited)], should_stop)
    return None if episodes is None else episodes[0]
