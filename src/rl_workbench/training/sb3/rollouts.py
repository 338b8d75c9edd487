"""Stable-Baselines3's algorithms, that ask before each rollout whether there is to be one.

There, after it has learned from the last one, all that a training is made of can be saved: a rollout
under way has no state that could.
"""

from typing import Any

from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.type_aliases import RolloutReturn

from rl_workbench.training.sb3.options import ON_POLICY, algorithm_class


class OnPolicy(OnPolicyAlgorithm):
    """Mix-in for those that learn from a rollout and forget it."""

    stride = 0  # steps of the last rollout, in all environments

    def collect_rollouts(
        self, env: Any, callback: Any, rollout_buffer: Any, n_rollout_steps: int
    ) -> bool:
        """Collects a rollout, unless the callback has it end."""
        if not callback.goes_on():
            return False
        return super().collect_rollouts(env, callback, rollout_buffer, n_rollout_steps)


class OffPolicy(OffPolicyAlgorithm):
    """Mix-in for those with a replay buffer; a rollout is their `train_freq`."""

    stride = 0  # steps of the last rollout, in all environments

    def collect_rollouts(
        self, env: Any, callback: Any, *arguments: Any, **named: Any
    ) -> RolloutReturn:
        """Collects a rollout, unless the callback has it end."""
        if not callback.goes_on():
            return RolloutReturn(0, 0, continue_training=False)
        return super().collect_rollouts(env, callback, *arguments, **named)


def asking_class(name: str) -> Any:
    """The algorithm's class with its mix-in.

    Args:
        name: one of `options.CLASSES`.
    """
    own = algorithm_class(name)
    return type(own.__name__, (OnPolicy if name in ON_POLICY else OffPolicy, own), {})
