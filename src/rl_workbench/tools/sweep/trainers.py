"""One training of a sweep, by the options that a trial picked."""

from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.runs.runs import open_run, summary_of
from rl_workbench.tools.sweep.sweep import Trainer
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.cli import train
from rl_workbench.training.options.training_options import choose
from rl_workbench.training.run.interrupt import Interrupt


def trainer(name: str, fixed: dict[str, Any]) -> Trainer:
    """What trains by an algorithm.

    Args:
        name: the algorithm's.
        fixed: options that every trial has.
    """

    def run(values: dict[str, Any], folder: Path, seed: int, interrupt: Interrupt) -> float | None:
        given = {**fixed, **values, "seed": seed, "run_dir": folder}
        pairs = [f"{key}={value}" for key, value in given.items()]
        train(choose(algorithm(name), ["--params", *pairs]), interrupt)
        return _best(folder)

    return run


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
