"""Learned policies with an environment to act in, and their episodes."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import torch
from torch import nn

from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import CONFIG_RECORD
from rl_workbench.tools.flags import RANDOM
from rl_workbench.tools.runs import Run
from rl_workbench.training import checkpoints
from rl_workbench.training.algorithm import load_policy
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.checked import Env
from rl_workbench.training.environments import make_environment
from rl_workbench.training.evaluator import Act, Evaluation, run_greedily
from rl_workbench.training.evaluator import episode_steps as episode_steps  # noqa: PLC0414 - public
from rl_workbench.training.options import recorded_options
from rl_workbench.training.progress import warn

TEST_SEED = 5_000_000  # other episodes than those of trainings and their evaluations


class Player(NamedTuple):
    """A learned or random policy and an environment of its training's kind, which the caller closes."""

    act: Act  # greedily, for one observation: (D,), or a dict as in the training
    env: Env
    network: nn.Module | None = None  # (N, D) to actions; a choice of N has `scores`, too
    checkpoint: Path | None = None  # None for random actions
    steps: int = 0  # of the training up to this checkpoint


def environment_of(run: Run, options: Mapping[str, Any]) -> Env:
    """Makes an environment with the observations that a run's policies expect."""
    keeps_dict = algorithm(run.algorithm).keeps_dict
    given = {**run.env_kwargs, **options}
    return make_environment(run.env_id, given, keep_dict=keeps_dict, wrapper=run.wrapper)


def load_any(run: Run, which: str, env_options: Mapping[str, Any], seed: int) -> Player:
    """Loads the policy of a checkpoint, see `load_learned`, or makes a random policy with that seed."""
    torch.set_num_threads(1)  # as in a training: more are slower, the more so beside other jobs
    if which != RANDOM:
        return load_learned(run, which, env_options)
    env = environment_of(run, env_options)
    return Player(random_actions(env, seed), env)


def random_actions(env: Env, seed: int) -> Act:
    """Returns a policy of random actions with that seed."""
    env.action_space.seed(seed)
    return lambda _: env.action_space.sample()


def load_learned(
    run: Run,
    which: str = "best",
    env_options: Mapping[str, Any] | None = None,
    say: Callable[[str], None] = warn,
    env: Env | None = None,
) -> Player:
    """Loads the policy of the checkpoint "best" or "last", or of an earlier one if that is damaged.

    `env_options` are added to the training's, `say` receives a line for each skipped checkpoint. It acts in
    `env`, by default a new environment of the run's kind. Raises WorkbenchError if no checkpoint can be read,
    it belongs to another run, or the environment can't be made.
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
        with ExitStack() as on_error:
            env = environment_of(run, env_options or {})
            on_error.callback(env.close)
            policy = _learned(run, path, content, env)
            on_error.pop_all()
            return policy
    reason = "none of its checkpoints can be read" if paths else "it has no checkpoint yet"
    raise WorkbenchError(f"{run.folder} has no policy: {reason}")


def _learned(run: Run, path: Path, content: dict[str, Any], env: Env) -> Player:
    options = recorded_options(content.get("config"), str(path))
    recorded = recorded_options(run.config, str(run.folder / CONFIG_RECORD))
    try:
        recorded.check_same(content["config"], str(path))
    except WorkbenchError as error:
        raise WorkbenchError(f"{path} isn't a checkpoint of {run.folder}") from error
    with checkpoints.fitting("number of steps"):
        steps = int(content["steps"])
    policy = load_policy(options, content, env, str(path))
    return Player(policy.act, env, policy.network, path, steps)


def play(policy: Player, episodes: int, seed: int) -> Evaluation:
    """Plays episodes of a policy in its environment, seeded once."""
    try:
        result = run_greedily(policy.env, policy.act, TEST_SEED + seed, episodes)
    except (ValueError, AssertionError) as error:
        raise WorkbenchError(f"the policy doesn't fit the environment: {error}") from error
    assert result is not None  # None would mean it was stopped
    return result
