"""Greedy episodes of a run's policy, and their figures."""

from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.runs.policies import LearnedPolicy
from rl_workbench.training.run.evaluator import Evaluation, run_greedily

TEST_SEED = 5_000_000  # other episodes than those of any training or of its evaluations


def play(policy: LearnedPolicy, episodes: int, seed: int) -> Evaluation:
    """Runs greedy episodes, seeded once.

    Raises:
        WorkbenchError: if the environment fails.
    """
    try:
        result = run_greedily(policy.env, policy.act, TEST_SEED + seed, episodes)
    except (ValueError, AssertionError) as error:
        raise WorkbenchError(f"the policy doesn't fit the environment: {error}") from error
    assert result is not None  # nothing told it to stop
    return result


class Step(NamedTuple):
    """What a step has brought; the first one is the reset, which has no action."""

    observation: np.ndarray
    action: Any
    reward: float
    finished: bool


def episode_steps(
    env: gymnasium.Env[Any, Any], act: Callable[[np.ndarray], Any], seed: int, longest: int = 0
) -> Iterator[Step]:
    """One episode, from the reset on.

    Args:
        act: chooses the action for an observation.
        longest: number of steps after which it is cut off; 0: never.
    """
    observation, _ = env.reset(seed=seed)
    yield Step(observation, None, 0.0, False)
    for length in count(1):
        action = act(np.asarray(observation, np.float32))
        observation, reward, terminated, truncated, _ = env.step(action)
        finished = terminated or truncated or length == longest
        yield Step(observation, action, float(reward), finished)
        if finished:
            return


def statistics(result: Evaluation, checkpoint: Path, threshold: float | None) -> dict[str, Any]:
    """Plain numbers, for JSON."""
    returns = np.array(result.returns)
    return {
        "checkpoint": str(checkpoint),
        "episodes": len(returns),
        "mean": float(returns.mean()),
        "std": float(returns.std()),
        "min": float(returns.min()),
        "max": float(returns.max()),
        "solved": None if threshold is None else bool(returns.mean() >= threshold),
        "returns": result.returns,
        "lengths": result.lengths,
    }


def lines(result: Evaluation) -> str:
    """A line for each episode."""
    rows = zip(result.returns, result.lengths, strict=True)
    return "\n".join(
        f"episode {index:4d} | return {total:9.2f} | length {length:5d}"
        for index, (total, length) in enumerate(rows)
    )


def summary(found: dict[str, Any], threshold: float | None) -> str:
    """The line that sums it up."""
    line = f"mean {found['mean']:.2f} ± {found['std']:.2f} over {found['episodes']} greedy episodes"
    line += f" (min {found['min']:.2f}, max {found['max']:.2f})"
    if threshold is not None:
        line += f"; {'solved' if found['solved'] else 'not solved'}: the line is {threshold:g}"
    return line
