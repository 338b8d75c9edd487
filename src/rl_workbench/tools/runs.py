"""Run folders: config.json, scalars.csv (also while it grows), summary.json at the end."""

import csv
import glob
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from file_access.content import open_text
from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import CONFIG_RECORD, read_json, read_record, reading
from rl_workbench.training.scalar_log import RETURN, SCALARS

SUMMARY = "summary.json"
SUITE_RECORD = "suite.json"  # in the folder of a benchmark
RECORDED = {  # types in config.json
    "algorithm": str, "env_id": str, "env_kwargs": dict, "exp_name": str, "seed": int,
}  # fmt: skip


@dataclass(frozen=True)
class Run:
    """The folder of one training."""

    folder: Path
    algorithm: str  # value of --algo
    experiment: str
    env_id: str
    env_kwargs: dict[str, Any]  # of the evaluations
    seed: int
    config: dict[str, Any]  # the whole record

    @property
    def wrapper(self) -> str:
        """What wraps its environments, as module:function; empty for nothing."""
        return str(self.config.get("run", {}).get("wrapper", ""))

    @property
    def name(self) -> str:
        """The name of the folder."""
        return self.folder.name


class Curve(NamedTuple):
    """Values over steps of the environment; all (N,), float64."""

    steps: np.ndarray
    values: np.ndarray


def open_run(folder: Path) -> Run:
    """Reads the record of a training."""
    config = read_record(folder)
    folder = folder.resolve()
    try:
        run = config["run"]
        for name, kind in RECORDED.items():
            value = config[name] if name == "algorithm" else run[name]
            if not isinstance(value, kind):
                raise TypeError(f"{name} is {value!r}")
        env_kwargs = {**run["env_kwargs"], **run.get("eval_env_kwargs", {})}
        names = run["exp_name"], run["env_id"]
        return Run(folder, config["algorithm"], *names, env_kwargs, run["seed"], config)
    except KeyError as error:
        raise WorkbenchError(f"{folder} is not a run folder: its record lacks {error}") from error
    except TypeError as error:
        text = f"its record is damaged: {error}"
        raise WorkbenchError(f"{folder} is not a run folder: {text}") from error


def read_leniently(path: Path) -> dict[str, Any]:
    """Returns the content of a JSON file; an empty dict if it can't be read."""
    try:
        content = read_json(path)
    except WorkbenchError:
        return {}
    return content if isinstance(content, dict) else {}


def summary_of(run: Run) -> dict[str, Any]:
    """Returns a training's summary; empty until its end."""
    path = run.folder / SUMMARY
    content = read_json(path)
    if content is None:
        return {}
    returns = content.get("returns", []) if isinstance(content, dict) else None
    if not isinstance(returns, list) or not all(isinstance(each, int | float) for each in returns):
        raise WorkbenchError(f"{path} isn't the summary of a training")
    return dict(content)


def cost_file(folder: Path) -> Path:
    """Returns the path of the file next to a run folder that holds its processes' times."""
    return folder.with_name(f"{folder.name}.cost.json")


def cost_of(folder: Path) -> dict[str, Any]:
    """Returns the processor time of a training's processes [s]; empty if unknown."""
    return read_leniently(cost_file(folder))


def is_run(folder: Path) -> bool:
    """Returns whether a training has written its record there."""
    return (folder / CONFIG_RECORD).is_file()


def find_runs(patterns: Sequence[str], warn: Callable[[str], None]) -> list[Run]:
    """Returns the runs of run folders, of patterns such as 'runs/*dqn*', and of folders that hold runs.

    Matches that aren't runs are skipped; `warn` receives a line for each whose record is damaged.
    """
    unique: dict[Path, Run] = {}
    for pattern in patterns:
        runs = _matching(pattern, warn)
        if not runs:
            raise WorkbenchError(f"there is no run folder at {pattern}")
        unique.update((run.folder, run) for run in runs)
    return list(unique.values())


def _matching(pattern: str, warn: Callable[[str], None]) -> list[Run]:
    path = Path(pattern)
    if is_run(path):
        return [open_run(path)]
    inside = list(map(Path, glob.glob(pattern)))
    if path.is_dir():  # a benchmark's has a folder for each variant
        inside = list(path.glob("*/*" if (path / SUITE_RECORD).is_file() else "*"))
    matching = []
    for folder in sorted(inside):
        if is_run(folder):
            try:
                matching.append(open_run(folder))
            except WorkbenchError as error:  # one damaged run mustn't stop the others
                warn(f"{error}; skipped")
    return matching


def training_curve(run: Run) -> Curve:
    """Returns the return of each finished training episode."""
    curve = curve_of(run.folder, RETURN)
    if not len(curve.values):
        raise WorkbenchError(f"{run.folder}: no episode has ended yet")
    return curve


def curve_of(folder: Path, tag: str) -> Curve:
    """Returns the values of a tag in a run folder; may be empty."""
    path = folder / SCALARS
    if not path.exists():
        return Curve(*np.empty((2, 0)))
    wrong = (KeyError, ValueError, TypeError, csv.Error)
    with reading(path, "isn't the table of a training: {}", wrong), open_text(path) as file:
        points = [
            (float(row["step"]), float(row["value"]))
            for row in csv.DictReader(file)
            # A running training may not have completed the last line yet.
            if row["tag"] == tag and row["wall_time"]
        ]
    return Curve(*np.array(points, dtype=float).reshape(-1, 2).T)
