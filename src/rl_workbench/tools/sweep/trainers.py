"""One training of a sweep: ours, or Stable-Baselines3's, by the options that a trial picked."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.algorithms import DQN
from rl_workbench.tools.runs.runs import open_run, summary_of
from rl_workbench.tools.sweep.sweep import Trainer
from rl_workbench.training.dqn import settings as dqn_settings
from rl_workbench.training.dqn.cli import run as run_dqn
from rl_workbench.training.run.interrupt import Interrupt


def names_of(algorithm: str) -> list[str]:
    """The options that can be searched.

    Raises:
        WorkbenchError: if the algorithm isn't installed.
    """
    if algorithm == DQN:
        return dqn_settings.OPTIONS.names
    from rl_workbench.training.sb3 import settings as sb3_settings

    return [*sb3_settings.OPTIONS.names, *sb3_settings.hyperparameter_names(algorithm)]


def trainer(algorithm: str, fixed: dict[str, Any]) -> Trainer:
    """What trains by that algorithm.

    Args:
        fixed: options that every trial has, as texts.
    """
    start: Callable[[dict[str, Any], Interrupt], None]
    start = _dqn if algorithm == DQN else lambda values, stop: _sb3(algorithm, values, stop)

    def train(
        values: dict[str, Any], folder: Path, seed: int, interrupt: Interrupt
    ) -> float | None:
        start({**fixed, **values, "seed": seed, "run_dir": str(folder)}, interrupt)
        return _best(folder)

    return train


def _dqn(values: dict[str, Any], interrupt: Interrupt) -> None:
    run_dqn(dqn_settings.choose([], values), interrupt)


def _sb3(algorithm: str, values: dict[str, Any], interrupt: Interrupt) -> None:
    from rl_workbench.training.sb3 import settings as sb3_settings
    from rl_workbench.training.sb3.run import train

    pairs = [f"{name}={value}" for name, value in values.items()]
    train(sb3_settings.choose(algorithm, ["--params", *pairs]), interrupt)


def _best(folder: Path) -> float | None:
    """The best evaluation's mean return, which every training writes down.

    Raises:
        WorkbenchError: if none was made.
    """
    summary = summary_of(open_run(folder))
    if summary.get("best"):
        return float(summary["best"][1])
    if summary.get("interrupted"):
        return None
    raise WorkbenchError(f"{folder} was never evaluated: eval_frequency is larger than its length")
