"""Run folders as they lie on disk, whichever command wrote them: what was trained, and its curve.

    dqn_train.py, workbench.py train   config.json, scalars.csv (also while it runs), summary.json
    pg_train.py                        summary.json (at its end)
"""

import csv
import glob
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from cartpole.errors import CartpoleError
from cartpole.training.dqn_settings import CONFIG_RECORD
from cartpole.training.evaluation import NOISE
from cartpole.training.scalar_log import NAME as SCALARS

SUMMARY = "summary.json"
RETURN, EVALUATION = "charts/episodic_return", "eval/mean_reward"  # tags
POLICY_GRADIENT = "pg"
PG_ENVIRONMENT = ("cartpole/Balance-v0", {"noise": NOISE})  # what pg_train.py evaluates in
_NOT_THERE = (FileNotFoundError, NotADirectoryError)


@dataclass(frozen=True)
class Run:
    """One training's folder."""

    folder: Path
    algorithm: str  # dqn, pg, or one of Stable-Baselines3's
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
    """Values over steps of the environment; both (N,), float64."""

    steps: np.ndarray
    values: np.ndarray


def open_run(folder: Path) -> Run:
    """Reads what a training says of itself.

    Raises:
        CartpoleError: if the folder isn't a run's.
    """
    if not folder.is_dir():
        raise CartpoleError(f"{folder} is no run folder: there is no such folder")
    folder = folder.resolve()
    config = _read_json(folder / CONFIG_RECORD)
    try:
        if config is not None:
            return _with_config(folder, config)
        return _policy_gradient(folder)
    except (KeyError, TypeError, AttributeError) as error:
        raise CartpoleError(f"{folder} is no run folder: its record lacks {error}") from error


def _with_config(folder: Path, config: dict[str, Any]) -> Run:
    run = config["run"]
    return Run(
        folder,
        config["algorithm"],
        run["exp_name"],
        run["env_id"],
        dict(run["env_kwargs"]),
        run["seed"],
        config,
    )


def _policy_gradient(folder: Path) -> Run:
    summary = _read_json(folder / SUMMARY)
    if summary is None:
        raise CartpoleError(
            f"{folder} is no run folder: it has neither {CONFIG_RECORD} nor {SUMMARY} "
            "(pg_train.py writes that at its end)"
        )
    settings = summary["settings"]
    experiment = f"{POLICY_GRADIENT}-{settings.get('algorithm', 'document')}"
    env_id, env_kwargs = PG_ENVIRONMENT
    record = {name: summary[name] for name in ("settings", "hyperparameters")}
    return Run(
        folder, POLICY_GRADIENT, experiment, env_id, dict(env_kwargs), settings["seed"], record
    )


def _read_json(path: Path) -> Any:
    """None where there is none."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except _NOT_THERE:
        return None
    except OSError as error:
        raise CartpoleError(f"can't read {path}: {error.strerror}") from error
    except ValueError as error:
        raise CartpoleError(f"{path} isn't JSON: {error}") from error


def summary_of(run: Run) -> dict[str, Any]:
    """What a run wrote at its end; empty as long as it hasn't.

    Raises:
        CartpoleError: if it can't be read.
    """
    return _read_json(run.folder / SUMMARY) or {}


def find_runs(patterns: Sequence[str]) -> list[Run]:
    """The runs of folders, of patterns such as 'runs/*dqn*', and of folders that hold runs.

    What matches a pattern or lies in a folder but is no run is passed over.

    Raises:
        CartpoleError: if one of them has no run.
    """
    found: dict[Path, Run] = {}
    for pattern in patterns:
        runs = _matching(pattern)
        if not runs:
            raise CartpoleError(f"there is no run folder at {pattern}")
        found.update((run.folder, run) for run in runs)
    return list(found.values())


def _matching(pattern: str) -> list[Run]:
    path = Path(pattern)
    if is_run(path):
        return [open_run(path)]
    inside = glob.glob(pattern) if not path.is_dir() else [str(each) for each in path.iterdir()]
    return [open_run(Path(each)) for each in sorted(inside) if is_run(Path(each))]


def is_run(folder: Path) -> bool:
    """Whether a training wrote its record there."""
    return any((folder / name).is_file() for name in (CONFIG_RECORD, SUMMARY))


def training_curve(run: Run) -> Curve:
    """The return of each finished episode, over the training's steps.

    Raises:
        CartpoleError: if no episode has ended yet, or the figures can't be read.
    """
    curve = _scalars(run, RETURN) if (run.folder / SCALARS).exists() else _from_summary(run)
    if not len(curve.values):
        raise CartpoleError(f"{run.folder}: no episode has ended yet")
    return curve


def evaluation_curve(run: Run) -> Curve:
    """The mean returns of the evaluations during the training; may be empty."""
    if not (run.folder / SCALARS).exists():
        return Curve(np.empty(0), np.empty(0))
    return _scalars(run, EVALUATION)


def _scalars(run: Run, tag: str) -> Curve:
    path = run.folder / SCALARS
    try:
        with path.open(newline="", encoding="utf-8") as file:
            points = [
                (float(row["step"]), float(row["value"]))
                for row in csv.DictReader(file)
                # A training that runs may not have written the last line's end yet.
                if row["tag"] == tag and row["wall_time"]
            ]
    except OSError as error:
        raise CartpoleError(f"can't read {path}: {error.strerror}") from error
    except (KeyError, ValueError, TypeError, csv.Error) as error:
        raise CartpoleError(f"{path} isn't the table of a training: {error}") from error
    return Curve(*np.array(points, dtype=float).reshape(-1, 2).T)


def _from_summary(run: Run) -> Curve:
    summary = summary_of(run)
    lengths, returns = summary.get("lengths", []), summary.get("returns", [])
    return Curve(np.cumsum(np.asarray(lengths, float)), np.asarray(returns, float))


def threshold(env_id: str) -> float | None:
    """The return from which Gymnasium calls an environment solved, if it says so."""
    spec = gymnasium.registry.get(env_id)
    return None if spec is None else spec.reward_threshold
