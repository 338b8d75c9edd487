"""`sweep`: Optuna looks for good options; every trial is a run folder of its own.

FOLDER/study.db          the study; calling again with the same folder goes on with it
FOLDER/trial_0000_seed_0 a training
FOLDER/trials.json       what was tried, and how it went
FOLDER/best.yaml         the best options, for --config
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import yaml

from rl_workbench.errors import WorkbenchError
from rl_workbench.extras import need
from rl_workbench.tools.sweep.ranges import Range
from rl_workbench.training.run.files import as_json, as_text, check_writable, write_file
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.progress import tell

STUDY, NAME = "study.db", "sweep"


class Trainer(Protocol):
    """Makes one training; returns its score, or None if it was interrupted before it had one."""

    def __call__(
        self, values: dict[str, Any], folder: Path, seed: int, interrupt: Interrupt
    ) -> float | None: ...


@dataclass(frozen=True)
class Sweep:
    """What is searched, and how much."""

    folder: Path
    section: str  # of best.yaml
    ranges: dict[str, Range]
    trials: int  # in all, those of earlier calls included
    seeds: int  # trainings of one trial; its score is their mean
    seed: int  # of the search


def run_sweep(sweep: Sweep, train: Trainer, interrupt: Interrupt) -> None:
    """Searches until there are as many trials as wanted, or until interrupted.

    Raises:
        WorkbenchError: if Optuna isn't installed, or the folder can't be used.
    """
    need("optuna", "Optuna", "sweep")
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    check_writable(sweep.folder / STUDY)
    study = _open(sweep, optuna)
    done = len(_complete(study, optuna))
    tell(f"{done} of {sweep.trials} trials are done: {sweep.folder}")
    for _ in range(sweep.trials - done):
        if interrupt.requested():
            break
        _run_trial(sweep, study, train, interrupt)
    _write_results(sweep, study, optuna)


def _open(sweep: Sweep, optuna: Any) -> Any:
    """The study, new or from disk; trials that a killed search left unfinished count as failed."""
    from sqlalchemy.exc import DatabaseError  # Optuna's own storage

    path = sweep.folder / STUDY
    try:
        study = optuna.create_study(
            storage=f"sqlite:///{path.resolve()}",
            study_name=NAME,
            direction="maximize",
            load_if_exists=True,
        )
    except (optuna.exceptions.OptunaError, DatabaseError) as error:
        raise WorkbenchError(f"{path} isn't a study that can be used") from error
    # Another seed for each call, or a search that goes on would draw its first trials again.
    study.sampler = optuna.samplers.TPESampler(seed=sweep.seed + len(study.trials))
    for trial in study.get_trials(states=[optuna.trial.TrialState.RUNNING]):
        study.tell(trial.number, state=optuna.trial.TrialState.FAIL)
    return study


def _complete(study: Any, optuna: Any) -> list[Any]:
    return list(study.get_trials(states=[optuna.trial.TrialState.COMPLETE]))


def _run_trial(sweep: Sweep, study: Any, train: Trainer, interrupt: Interrupt) -> None:
    """One trial; one that fails is noted and costs no other."""
    from optuna.trial import TrialState

    trial = study.ask()
    values = {name: each.suggest(trial, name) for name, each in sweep.ranges.items()}
    score = None
    try:
        score = _score(sweep, trial.number, values, train, interrupt)
    except WorkbenchError as error:
        trial.set_user_attr("failure", str(error))
        tell(f"trial {trial.number} failed: {error}")
    finally:
        state = TrialState.FAIL if score is None else TrialState.COMPLETE
        study.tell(trial, score, state=state)
    if score is not None:
        tell(f"trial {trial.number}: {score:.2f} with {values}")


def _score(
    sweep: Sweep, number: int, values: dict[str, Any], train: Trainer, interrupt: Interrupt
) -> float | None:
    """The mean over seeds; None if interrupted."""
    scores = []
    for seed in range(sweep.seeds):
        score = train(values, sweep.folder / f"trial_{number:04d}_seed_{seed}", seed, interrupt)
        if score is None or interrupt.requested():
            return None
        scores.append(score)
    return float(np.mean(scores))


def _write_results(sweep: Sweep, study: Any, optuna: Any) -> None:
    rows = [
        {
            "number": trial.number,
            "state": trial.state.name.lower(),
            "score": trial.value,
            "options": trial.params,
            "failure": trial.user_attrs.get("failure"),
        }
        for trial in study.trials
    ]
    write_file(sweep.folder / "trials.json", as_json(rows))
    if not _complete(study, optuna):
        tell("no trial came to its end")
        return
    best = yaml.safe_dump({sweep.section: study.best_params})
    write_file(sweep.folder / "best.yaml", as_text(best))
    tell(
        f"best: trial {study.best_trial.number}, {study.best_value:.2f}; its options are in "
        f"{sweep.folder / 'best.yaml'}"
    )
