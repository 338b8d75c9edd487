"""Greedy episodes of a run's policy, or random ones, and their figures."""

from collections.abc import Callable, Iterator
from itertools import count
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.runs.policies import RANDOM, LearnedPolicy, RandomPolicy
from rl_workbench.training.environments import as_float32, succeeded
from rl_workbench.training.evaluator import Evaluation, run_greedily

TEST_SEED = 5_000_000  # other episodes than those of any training or of its evaluations


def play(policy: LearnedPolicy | RandomPolicy, episodes: int, seed: int) -> Evaluation:
    """Runs a policy's episodes, seeded once.

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

    observation: Any
    action: Any
    reward: float
    finished: bool
    success: bool | None  # None before the end, or if the environment doesn't say


def episode_steps(
    env: gymnasium.Env[Any, Any], act: Callable[[Any], Any], seed: int, longest: int = 0
) -> Iterator[Step]:
    """One episode, from the reset on.

    Args:
        act: chooses the action for an observation.
        longest: number of steps after which it is cut off; 0: never.
    """
    observation, _ = env.reset(seed=seed)
    yield Step(observation, None, 0.0, False, None)
    for length in count(1):
        action = act(as_float32(observation))
        observation, reward, terminated, truncated, info = env.step(action)
        finished = terminated or truncated or length == longest
        success = succeeded(info) if finished else None
        yield Step(observation, action, float(reward), finished, success)
        if finished:
            return


def statistics(result: Evaluation, checkpoint: str, threshold: float | None) -> dict[str, Any]:
    """Plain numbers, for JSON.

    Args:
        checkpoint: the file of the policy, or `random`.
        threshold: from which on it is solved, if there is one.
    """
    returns = np.array(result.returns)
    return {
        "checkpoint": checkpoint,
        "episodes": len(returns),
        "mean": float(returns.mean()),
        "std": float(returns.std()),
        "min": float(returns.min()),
        "max": float(returns.max()),
        "success_rate": result.success_rate,
        "solved": None if threshold is None else bool(returns.mean() >= threshold),
        "returns": result.returns,
        "lengths": result.lengths,
        "successes": result.successes,
    }


def lines(result: Evaluation) -> str:
    """A line for each episode."""
    rows = zip(result.returns, result.lengths, strict=True)
    told = [
        f"episode {index:4d} | return {total:9.2f} | length {length:5d}"
        for index, (total, length) in enumerate(rows)
    ]
    if len(result.successes) == len(told):
        words = ["success" if each else "no success" for each in result.successes]
        told = [f"{line} | {word}" for line, word in zip(told, words, strict=True)]
    return "\n".join(told)


def summary(found: dict[str, Any], threshold: float | None) -> str:
    """The line that sums it up."""
    kind = "random" if found["checkpoint"] == RANDOM else "greedy"
    line = f"mean {found['mean']:.2f} ± {found['std']:.2f} over {found['episodes']} {kind} episodes"
    line += f" (min {found['min']:.2f}, max {found['max']:.2f})"
    if found["success_rate"] is not None:
        line += f"; success {found['success_rate']:.0%}"
    if threshold is not None:
        line += f"; {'solved' if found['solved'] else 'not solved'}: the line is {threshold:g}"
    return line
