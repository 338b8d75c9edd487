"""Run folders as they lie on disk, whichever command wrote them: what was trained, and its curve.

config.json, scalars.csv (also while it runs), summary.json (at its end)
"""

import csv
import glob
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from files.content import open_text
from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import CONFIG_RECORD
from rl_workbench.training.scalar_log import EVALUATION, RETURN, SUCCESS
from rl_workbench.training.scalar_log import NAME as SCALARS

SUMMARY = "summary.json"
RECORDED = {"env_id": str, "env_kwargs": dict, "exp_name": str, "seed": int}
_NOT_THERE = (FileNotFoundError, NotADirectoryError)


@dataclass(frozen=True)
class Run:
    """One training's folder."""

    folder: Path
    algorithm: str  # of --algo
    experiment: str
    env_id: str
    env_kwargs: dict[str, Any]
    seed: int
    config: dict[str, Any]  # the whole record

    @property
    def name(self) -> str:
        """The folder's own name."""
        return self.folder.name

    @property
    def label(self) -> str:
        """For pictures and tables."""
        return f"{self.experiment}, {self.env_id}, seed {self.seed}"


class Curve(NamedTuple):
    """Values over steps of the environment; all (N,), float64."""

    steps: np.ndarray
    values: np.ndarray
    times: np.ndarray  # of the clock [s since 1970]


def open_run(folder: Path) -> Run:
    """Reads what a training says of itself.

    Raises:
        WorkbenchError: if the folder isn't a run's.
    """
    if not folder.is_dir():
        raise WorkbenchError(f"{folder} is no run folder: there is no such folder")
    folder = folder.resolve()
    config = _read_json(folder / CONFIG_RECORD)
    if config is None:
        raise WorkbenchError(f"{folder} is no run folder: it has no {CONFIG_RECORD}")
    try:
        return _with_config(folder, config)
    except KeyError as error:
        raise WorkbenchError(f"{folder} is no run folder: its record lacks {error}") from error
    except TypeError as error:
        text = f"its record is damaged: {error}"
        raise WorkbenchError(f"{folder} is no run folder: {text}") from error


def _with_config(folder: Path, config: dict[str, Any]) -> Run:
    run = config["run"]
    for name, kind in RECORDED.items():
        if not isinstance(run[name], kind) or isinstance(run[name], bool):
            raise TypeError(f"{name} is {run[name]!r}")
    # Those of its evaluations, without what was its training's alone; older records have neither.
    env_kwargs = {**run["env_kwargs"], **run.get("eval_env_kwargs", {})}
    return Run(
        folder,
        config["algorithm"],
        run["exp_name"],
        run["env_id"],
        env_kwargs,
        run["seed"],
        config,
    )


def _read_json(path: Path) -> Any:
    """None where there is none."""
    try:
        with open_text(path) as file:
            return json.load(file)
    except _NOT_THERE:
        return None
    except OSError as error:
        raise WorkbenchError(f"can't read {path}: {error.strerror}") from error
    except ValueError as error:
        raise WorkbenchError(f"{path} isn't JSON: {error}") from error


def summary_of(run: Run) -> dict[str, Any]:
    """What a run wrote at its end; empty as long as it hasn't.

    Raises:
        WorkbenchError: if it can't be read, or is something else.
    """
    path = run.folder / SUMMARY
    content = _read_json(path)
    if content is None:
        return {}
    returns = content.get("returns", []) if isinstance(content, dict) else None
    if not isinstance(returns, list) or not all(isinstance(each, int | float) for each in returns):
        raise WorkbenchError(f"{path} isn't the summary of a training")
    return dict(content)


def cost_file(folder: Path) -> Path:
    """Beside a run's folder: what its processes took, if `benchmark` trained it."""
    return folder.with_name(f"{folder.name}.cost.json")


def cost_of(folder: Path) -> dict[str, Any]:
    """Seconds of the clock and of the processor, and when it ran; empty if that isn't known."""
    return read_leniently(cost_file(folder))


def read_leniently(path: Path) -> dict[str, Any]:
    """What a JSON file holds; nothing if it can't be read."""
    try:
        content = _read_json(path)
    except WorkbenchError:
        return {}
    return content if isinstance(content, dict) else {}


def find_runs(patterns: Sequence[str], warn: Callable[[str], None]) -> list[Run]:
    """The runs of folders, of patterns such as 'runs/*dqn*', and of folders that hold runs.

    What matches a pattern or lies in a folder but is no run is passed over.

    Args:
        warn: is told of runs that are passed over because their record is damaged.

    Raises:
        WorkbenchError: if one of them has no run, or is a run with a damaged record.
    """
    found: dict[Path, Run] = {}
    for pattern in patterns:
        runs = _matching(pattern, warn)
        if not runs:
            raise WorkbenchError(f"there is no run folder at {pattern}")
        found.update((run.folder, run) for run in runs)
    return list(found.values())


def _matching(pattern: str, warn: Callable[[str], None]) -> list[Run]:
    path = Path(pattern)
    if is_run(path):
        return [open_run(path)]
    inside = glob.glob(pattern) if not path.is_dir() else [str(each) for each in path.iterdir()]
    found = []
    for folder in map(Path, sorted(inside)):
        if is_run(folder):
            try:
                found.append(open_run(folder))
            except WorkbenchError as error:  # one damaged run costs no other
                warn(f"{error}; passed over")
    return found


def is_run(folder: Path) -> bool:
    """Whether a training wrote its record there."""
    return (folder / CONFIG_RECORD).is_file()


def training_curve(run: Run) -> Curve:
    """The return of each finished episode, over the training's steps.

    Raises:
        WorkbenchError: if no episode has ended yet, or the figures can't be read.
    """
    curve = _scalars(run, RETURN)
    if not len(curve.values):
        raise WorkbenchError(f"{run.folder}: no episode has ended yet")
    return curve


def success_curve(run: Run) -> Curve:
    """The success rate of the last 100 training episodes, at each one's end; empty if they don't say."""
    return evaluation_curve(run, SUCCESS)


def evaluation_curve(run: Run, tag: str = EVALUATION) -> Curve:
    """The mean returns of the evaluations during the training; may be empty.

    Args:
        tag: EVALUATION for all, CONFIRMED for those that chose the best policy.
    """
    if not (run.folder / SCALARS).exists():
        return Curve(*np.empty((3, 0)))
    return _scalars(run, tag)


def _scalars(run: Run, tag: str) -> Curve:
    path = run.folder / SCALARS
    try:
        with open_text(path) as file:
            points = [
                (float(row["step"]), float(row["value"]), float(row["wall_time"]))
                for row in csv.DictReader(file)
                # A training that runs may not have written the last line's end yet.
                if row["tag"] == tag and row["wall_time"]
            ]
    except OSError as error:
        raise WorkbenchError(f"can't read {path}: {error.strerror}") from error
    except (KeyError, ValueError, TypeError, csv.Error) as error:
        raise WorkbenchError(f"{path} isn't the table of a training: {error}") from error
    return Curve(*np.array(points, dtype=float).reshape(-1, 3).T)
