"""The trainings of a trial: as jobs, while they run, and at their end."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.jobs.job import Job
from rl_workbench.tools.runs.runs import open_run
from rl_workbench.training.scalar_log import EVALUATION
from viewer.table import GrowingTable


def flags(algorithm: str, options: dict[str, Any]) -> list[str]:
    """What `train` is told, but for name, seed and folder."""
    pairs = [f"{key}={value}" for key, value in options.items()]
    return ["--algo", algorithm, "--params", *pairs]


def training(folder: Path, algorithm: str, options: dict[str, Any], name: str, seed: int) -> Job:
    """One training of a trial.

    Args:
        folder: its own.
        options: those that are fixed and those that were picked.
        name: the trial's.
    """
    own = [f"--exp-name={name}", f"--seed={seed}"]
    return Job(f"{name}, seed {seed}", folder, (*own, *flags(algorithm, options)))


class Evaluations:
    """The evaluations in a run folder, as they come.

    Args:
        folder: may not be there yet.
        frequency: steps between two that are due; 0 if only the end is evaluated.
    """

    def __init__(self, folder: Path, frequency: int) -> None:
        self._table, self._frequency = GrowingTable(folder), frequency

    def new(self) -> Iterator[tuple[int, float]]:
        """Those since the last call: the multiple of `frequency` that was due, and the mean return.

        Episodes and vectors pass over some steps, so two trainings may be evaluated at steps that differ.
        """
        look = self._table.read()
        for step, tag, value in look.points:
            if tag == EVALUATION and self._frequency:
                yield int(step) // self._frequency * self._frequency, value
        if look.has_more:
            yield from self.new()


def score_of(job: Job) -> float:
    """The best evaluation's mean return, which every training writes down.

    Raises:
        WorkbenchError: if the training failed, or none was made.
    """
    summary = job.summary()
    if summary.get("best"):
        return float(summary["best"][1])
    open_run(job.folder)  # says what is wrong with it, if something is
    raise WorkbenchError(
        f"{job.folder} was never evaluated: eval_frequency is larger than its length"
    )
