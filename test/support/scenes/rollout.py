"""All that an environment gives, to be compared bit by bit."""

from typing import Any

import gymnasium
from gymnasium.utils.env_checker import data_equivalence


def rollout(env: gymnasium.Env[Any, Any], steps: int, seed: int) -> list[tuple[Any, ...]]:
    """What it gives for seeded random actions; episodes follow one another."""
    env.action_space.seed(seed)
    given: list[tuple[Any, ...]] = [env.reset(seed=seed)]
    for _ in range(steps):
        given.append(env.step(env.action_space.sample()))
        if given[-1][2] or given[-1][3]:
            given.append(env.reset())
    return given


def same(one: list[tuple[Any, ...]], other: list[tuple[Any, ...]]) -> bool:
    """Whether both have the same bits."""
    return len(one) == len(other) and all(
        data_equivalence(a, b, exact=True) for a, b in zip(one, other, strict=True)
    )
