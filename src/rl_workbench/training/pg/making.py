"""What a policy gradient is made of: in environments of this process, or of workers."""

from typing import Any

import gymnasium

from rl_workbench.training.options.training_options import TrainingOptions
from rl_workbench.training.pg.algorithm import PolicyGradientTraining, load_policy, make_agent
from rl_workbench.training.pg.collecting import LocalEpisodes
from rl_workbench.training.run.algorithm import in_its_environments

__all__ = ["load_policy", "make"]


def make(options: TrainingOptions) -> PolicyGradientTraining:
    """A new training; see `make_algorithm`."""

    def learning_in(envs: list[gymnasium.Env[Any, Any]]) -> PolicyGradientTraining:
        agent = make_agent(options, envs[0])
        source = LocalEpisodes(envs, agent, options.run.seed)
        return PolicyGradientTraining(options, envs[0], agent, source)

    return in_its_environments(options, learning_in)
