"""Whole episodes that workers play: the same, bit for bit, as those that are played in this process."""

import math
import zlib
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import gymnasium
from gymnasium import spaces

from rl_workbench.agents.pg.document import Episode
from rl_workbench.agents.pg.reinforce import ReinforceAgent
from rl_workbench.states import set_generator
from rl_workbench.training.options.training_options import MakePool, TrainingOptions
from rl_workbench.training.pg.algorithm import PolicyGradientTraining, make_agent
from rl_workbench.training.pg.episodes import run_episode
from rl_workbench.training.pg.generators import action_generator, generator_state, packed, unpacked
from rl_workbench.training.player import Player, Pool
from rl_workbench.training.run.algorithm import environment_for, environments_elsewhere
from rl_workbench.training.run.random_states import seed_all


class Place(NamedTuple):
    """Where the generators of an environment and of its actions are, each as `generator_state` has it."""

    environment: str
    actions: str


class Played(NamedTuple):
    """An episode, with where its generators ended."""

    episode: dict[str, Any] | None  # as `Episode.state_dict` has it; None if none was to be played
    success: bool | None
    place: Place


class EpisodePlayer(Player):
    """Plays whole episodes in one environment.

    Args:
        options: of the training.
        index: of the environment, which is seeded by the training's seed + index.

    Raises:
        WorkbenchError: if the environment can't be made.
    """

    def __init__(self, options: TrainingOptions, index: int) -> None:
        self._seed, self._index = options.run.seed + index, index
        self._env = environment_for(options, options.run.training_environment)
        agent = make_agent(options, self._env)
        assert isinstance(agent, ReinforceAgent)
        self._agent = agent
        self._actions = action_generator(options.run.seed, index)
        self._is_seeded = False

    def play(self, policy: Any, state: Place | None) -> Played:
        """See `Player.play`.

        Args:
            policy: the agent's `policy_state`.
            state: where its generators are; None has the environment seeded, and no more.
        """
        if state is None or not self._is_seeded:
            self._env.reset(seed=self._seed)
            self._is_seeded = True
        if state is None:
            return Played(None, None, self._place())
        set_generator(self._env.unwrapped.np_random, state.environment)
        set_generator(self._actions, state.actions)
        # Environments of other people may use the generators that a whole process shares.
        seed_all(zlib.crc32(f"{self._index} {state.environment}".encode()))
        self._agent.act_by(policy)
        draw = partial(self._agent.draw, generator=self._actions)
        episode = run_episode(self._env, draw, lambda: False, self._agent.limited)
        assert episode is not None
        return Played(episode.state_dict(), episode.success, self._place())

    def _place(self) -> Place:
        environment = generator_state(self._env.unwrapped.np_random)
        return Place(environment, generator_state(self._actions))

    def close(self) -> None:
        """See `Player.close`."""
        self._env.close()


def make_remote(options: TrainingOptions, make_pool: MakePool) -> PolicyGradientTraining:
    """A training by episodes that workers play; see `make_algorithm`."""
    here, theirs = environments_elsewhere(options)
    agent = make_agent(options, here)
    assert isinstance(agent, ReinforceAgent)
    pool = make_pool(theirs)
    source = RemoteEpisodes(pool, agent, here, options.run.seed, options.run.num_envs)
    return PolicyGradientTraining(options, here, agent, source)


class RemoteEpisodes:
    """Episodes from environments on other machines; see `EpisodeSource`.

    Args:
        pool: plays them; closed with this.
        agent: its policy plays.
        env: of the kind that is played in.
        seed: of the training.
        count: of environments.
    """

    def __init__(
        self,
        pool: Pool,
        agent: ReinforceAgent,
        env: gymnasium.Env[Any, Any],
        seed: int,
        count: int,
    ) -> None:
        self._pool, self._agent, self._count = pool, agent, count
        (self._size,) = env.observation_space.shape or (0,)
        self._kind: int | tuple[int, ...] = (math.prod(env.action_space.shape or ()),)
        if isinstance(env.action_space, spaces.Discrete):
            self._kind = int(env.action_space.n)
        others = [action_generator(seed, index) for index in range(1, count)]
        self._actions = [agent.generator, *others]
        self._environments: list[str] = []

    def seed(self) -> None:
        """See `EpisodeSource`."""
        played = self._pool.play(None, [None] * self._count, lambda: False)
        assert played is not None
        self._environments = [each.place.environment for each in played]

    def collect(self, should_stop: Callable[[], bool]) -> list[Episode] | None:
        """See `EpisodeSource`."""
        places = [
            Place(environment, generator_state(actions))
            for environment, actions in zip(self._environments, self._actions, strict=True)
        ]
        played = self._pool.play(self._agent.policy_state(), places, should_stop)
        if played is None:
            return None
        self._environments = [each.place.environment for each in played]
        for generator, each in zip(self._actions, played, strict=True):
            set_generator(generator, each.place.actions)
        return [self._episode(each) for each in played]

    def _episode(self, played: Played) -> Episode:
        assert played.episode is not None
        episode = Episode.from_state(played.episode, self._size, self._kind)
        episode.success = played.success
        return episode

    def mark(self) -> None:
        """See `EpisodeSource`."""
        actions = [generator_state(each) for each in self._actions]
        self._marked = list(self._environments), actions

    def rewind(self) -> None:
        """See `EpisodeSource`."""
        environments, actions = self._marked
        self._environments = list(environments)
        for generator, text in zip(self._actions, actions, strict=True):
            set_generator(generator, text)

    def state(self) -> Any:
        """See `EpisodeSource`."""
        return packed(self._environments, [generator_state(each) for each in self._actions[1:]])

    def load_state(self, state: Any) -> None:
        """See `EpisodeSource`."""
        self._environments, actions = unpacked(state, self._count)
        for generator, text in zip(self._actions[1:], actions, strict=True):
            set_generator(generator, text)

    def close(self) -> None:
        """See `EpisodeSource`."""
        self._pool.close()
