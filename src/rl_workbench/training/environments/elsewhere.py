"""Environments that are played in by workers, as the driver of a training sees them."""

from typing import Any, NoReturn

import gymnasium


class Elsewhere(gymnasium.Env[Any, Any]):
    """Stands for an environment that is played in elsewhere: tells its spaces, and can't be stepped.

    Args:
        env: one of the same kind.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        self.observation_space, self.action_space = env.observation_space, env.action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Any observation: a learner of Stable-Baselines3 asks for one, and acts by none."""
        return self.observation_space.sample(), {}

    def step(self, action: Any) -> NoReturn:
        """Nobody asks for it."""
        raise NotImplementedError("a worker steps this environment")
