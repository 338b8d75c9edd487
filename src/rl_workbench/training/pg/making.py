"""What a policy gradient is made of: in environments of this process, or of workers."""

from typing import Any

import gymnasium

from rl_workbench.training.options.training_options import TrainingOptions
from rl_workbench.training.pg.algorithm import PolicyGradientTraining, load_policy, make_agent
from rl_workbench.training.pg.collecting import LocalEpisodes
from rl_workbench.training.pg.remote import EpisodePlayer, make_remote
from rl_workbench.training.player import Player
from rl_workbench.training.run.algorithm import in_its_environments

__all__ = ["load_policy", "make", "make_player"]


def make(options: TrainingOptions) -> PolicyGradientTraining:
    """A new training; see `make_algorithm`."""
    if options.make_pool is not None:
        return make_remote(options, options.make_pool)

    def learning_in(envs: list[gymnasium.Env[Any, Any]]) -> PolicyGradientTraining:
        agent = make_agent(options, envs[0])
        source = LocalEpisodes(envs, agent, options.run.seed)
        return PolicyGradientTraining(options, envs[0], agent, source)

    return in_its_environments(options, learning_in)


def make_player(options: TrainingOptions, index: int) -> Player:
    """What plays in the environment `index`, for a worker; see `Player`."""
    return EpisodePlayer(options, index)
