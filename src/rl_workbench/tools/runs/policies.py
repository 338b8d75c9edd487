"""What a training learned, ready to act in an environment of its kind."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from torch import nn

from rl_workbench.errors import WorkbenchError
from rl_workbench.states import whole
from rl_workbench.storage import CONFIG_RECORD
from rl_workbench.tools.runs.runs import Run
from rl_workbench.training import checkpoints
from rl_workbench.training.algorithm import load_policy
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.environments import make_environment
from rl_workbench.training.options import recorded_options
from rl_workbench.training.progress import warn

WHICH = ("best", "last")
RANDOM = "random"  # a policy that every environment has


class RandomPolicy(NamedTuple):
    """Random actions in a run's environment, which the caller closes."""

    act: Callable[[Any], Any]
    env: gymnasium.Env[Any, Any]


class LearnedPolicy(NamedTuple):
    """A learned policy, and an environment of the kind it learned in; the caller closes that."""

    act: Callable[[Any], Any]  # greedily, for one observation: (D,), or a dict as it learned from
    preference: Callable[[np.ndarray], np.ndarray]  # of (N, D): (N,), see meaning
    meaning: str  # of the preference: positive is the last action, or a push to the right
    network: nn.Module  # of `act`, for many observations: see Policy
    env: gymnasium.Env[Any, Any]
    checkpoint: Path
    steps: int  # of the training that it is from


def environment_of(run: Run, given: Mapping[str, Any]) -> gymnasium.Env[Any, Any]:
    """An environment as a run's policies observe it.

    Args:
        given: its options on top of the training's own.

    Raises:
        WorkbenchError: if it can't be made.
    """
    keeps_dict = algorithm(run.algorithm).keeps_dict
    return make_environment(run.env_id, {**run.env_kwargs, **given}, keep_dict=keeps_dict)


def random_policy(run: Run, env_options: Mapping[str, Any], seed: int) -> RandomPolicy:
    """Actions that the environment's space draws.

    Raises:
        WorkbenchError: if the environment can't be made.
    """
    env = environment_of(run, env_options)
    env.action_space.seed(seed)
    return RandomPolicy(lambda _: env.action_space.sample(), env)


def load_learned(
    run: Run,
    which: str = "best",
    env_options: Mapping[str, Any] | None = None,
    say: Callable[[str], None] = warn,
    env: gymnasium.Env[Any, Any] | None = None,
) -> LearnedPolicy:
    """The policy of a run's best or last checkpoint, or of the one before it if that is damaged.

    Args:
        env_options: of the environment, on top of the training's own; such as `render_mode`.
        say: is told of what is passed over.
        env: to act in, of this run's kind; by default one is made.

    Raises:
        WorkbenchError: if there is no checkpoint that can be read, it is another run's, or there
            is no such environment.
    """
    paths = checkpoints.candidates(run.folder, best_first=which == "best")
    for path in paths:
        try:
            content = checkpoints.read(path)
        except WorkbenchError as error:
            say(f"{error}; taking an earlier one")
            continue
        if env is not None:
            return _learned(run, path, content, env)
        with ExitStack() as made:
            env = environment_of(run, env_options or {})
            made.callback(env.close)
            policy = _learned(run, path, content, env)
            made.pop_all()
            return policy
    reason = "none of its checkpoints can be read" if paths else "it has no checkpoint yet"
    raise WorkbenchError(f"{run.folder} has no policy: {reason}")


def _learned(
    run: Run, path: Path, content: dict[str, Any], env: gymnasium.Env[Any, Any]
) -> LearnedPolicy:
    options = recorded_options(content.get("config"), str(path))
    recorded = recorded_options(run.config, str(run.folder / CONFIG_RECORD))
    try:
        recorded.check_same(content["config"], str(path))
    except WorkbenchError as error:
        raise WorkbenchError(f"{path} isn't a checkpoint of {run.folder}") from error
    with checkpoints.fitting("number of steps"):
        steps = whole(content["steps"])
    return LearnedPolicy(*load_policy(options, content, env, str(path)), env, path, steps)
