"""What a training learned, ready to act: one `Player` for every kind of run."""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.runs.runs import POLICY_GRADIENT, Run
from rl_workbench.training.dqn.policy import policy_of
from rl_workbench.training.pg import policy as pg_policy
from rl_workbench.training.run import checkpoints as run_checkpoints

WHICH = ("best", "last")


class Player(NamedTuple):
    """A learned policy, and an environment of the kind it learned in; the caller closes that."""

    act: Callable[[np.ndarray], Any]  # greedily, for one observation (D,)
    preference: Callable[[np.ndarray], np.ndarray]  # of (N, D): (N,), see meaning
    meaning: str  # of the preference: positive is the last action, or a push to the right
    env: gymnasium.Env[Any, Any]
    checkpoint: Path


def warn(text: str) -> None:
    """Tells the user beside the results."""
    print(text, file=sys.stderr, flush=True)


def load_player(
    run: Run,
    which: str = "best",
    env_options: Mapping[str, Any] | None = None,
    say: Callable[[str], None] = warn,
) -> Player:
    """The policy of a run's best or last checkpoint, or of the one before it if that is damaged.

    Args:
        env_options: of the environment, on top of the training's own; such as `render_mode`.
        say: is told of what is passed over.

    Raises:
        WorkbenchError: if there is no checkpoint that can be read, or no such environment.
    """
    load = _loader(run)
    options = {**run.env_kwargs, **(env_options or {})}
    paths = candidates(run, which)
    for path in paths:
        try:
            state = run_checkpoints.read(path)
        except WorkbenchError as error:
            say(f"{error}; taking an earlier one")
            continue
        return load(run, path, state, options)
    reason = "none of its checkpoints can be read" if paths else "it has no checkpoint yet"
    raise WorkbenchError(f"{run.folder} has no policy: {reason}")


def _loader(run: Run) -> Callable[[Run, Path, dict[str, Any], dict[str, Any]], Player]:
    if run.algorithm == "dqn":
        return _dqn
    if run.algorithm == POLICY_GRADIENT:
        return _policy_gradient
    from rl_workbench.tools.runs.sb3_player import load_sb3  # the extra may not be there

    return load_sb3


def candidates(run: Run, which: str) -> list[Path]:
    """Checkpoints in the order in which they are tried; only those that exist."""
    return run_checkpoints.candidates(run.folder, best_first=which == "best")


def _dqn(run: Run, path: Path, state: dict[str, Any], options: dict[str, Any]) -> Player:
    policy = policy_of(state, str(path), options)
    agent = policy.agent

    def preference(observations: np.ndarray) -> np.ndarray:
        values = agent.q_values(observations)
        return np.asarray(values[:, -1] - values[:, 0])

    return Player(agent.act_greedily, preference, "Q(right) - Q(left)", policy.env, path)


def _policy_gradient(
    run: Run, path: Path, state: dict[str, Any], options: dict[str, Any]
) -> Player:
    policy = pg_policy.policy_of(state, str(path), options)
    agent = policy.agent

    def preference(observations: np.ndarray) -> np.ndarray:
        found = [agent.probabilities(each) for each in observations]
        return np.array([each[-1] - each[0] for each in found])

    return Player(agent.act_greedily, preference, "P(right) - P(left)", policy.env, path)
