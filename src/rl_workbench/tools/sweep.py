"""`sweep`: Optuna searches for good options; every training has its own run folder.

FOLDER/sweep.json         the search's settings; the folder accepts no other search
FOLDER/study.db           Optuna's study, with all trials; the same command continues it
FOLDER/trial_0000/seed_0  a training
FOLDER/best.yaml          the best options, for --config
"""

import argparse
import contextlib
import threading
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from rl_workbench.env_ids import as_file_name
from rl_workbench.errors import WorkbenchError, need
from rl_workbench.option import key_values, unknown
from rl_workbench.starting import Interrupt
from rl_workbench.storage import as_text, write_file
from rl_workbench.tools.flags import add_job_flags, number
from rl_workbench.tools.jobs import Job
from rl_workbench.tools.pool import Pool, claimed, job_pool
from rl_workbench.tools.runs import curve_of
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options import default_file, known_options, read_section, section_names
from rl_workbench.training.progress import tell
from rl_workbench.training.scalar_log import EVALUATION, SCALARS
from rl_workbench.training.train import choose

RECORD, STUDY, RANGES = "sweep.json", "study.db", "sweep.yaml"
PRUNERS = ("median", "hyperband", "none")


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add = parser.add_argument
    add("--algo", choices=tuple(ALGORITHMS), default="dqn", help="the algorithm (default dqn)")
    add("--env-id", default="CartPole-v1", metavar="ID",
        help="the environment (default CartPole-v1)")  # fmt: skip
    add("--params", nargs="+", default=[], metavar="KEY=VALUE",
        help="fixed options of every training, excluded from the search")  # fmt: skip
    add("--ranges", type=Path, metavar="FILE", help="ranges to search (default config/sweep.yaml)")
    add("--trials", type=number(1), default=20, metavar="N", help="number of trials (default 20)")
    add("--seeds", type=number(1), default=1, metavar="N",
        help="trainings per trial; its score is their mean (default 1)")  # fmt: skip
    add("--seed", type=number(0), default=0, metavar="N", help="seed of the search (default 0)")
    add("--total-timesteps", type=number(1), metavar="N", help="length of each training [steps]")
    add("--pruner", choices=PRUNERS, default=PRUNERS[0],
        help="how to end trials that fall behind the others (default median)")  # fmt: skip
    add_job_flags(parser)
    add("--out", type=Path, metavar="FOLDER",
        help="folder of the study; an existing one is continued (default runs/sweep__ENV__ALGO)")  # fmt: skip


@dataclass(frozen=True)
class Sweep:
    """The settings of a search."""

    folder: Path
    algorithm: str
    options: dict[str, Any]  # of every training
    ranges: dict[str, Any]  # Optuna's distributions
    trials: int  # in all, including those of earlier commands
    seeds: int  # trainings of one trial
    seed: int  # of the search
    pruner: str

    def flags(self, values: dict[str, Any]) -> list[str]:
        """Returns the flags of `train` for a trial."""
        options = {**self.options, **values}
        pairs = [f"{key}={value}" for key, value in options.items()]
        return ["--algo", self.algorithm, "--params", *pairs]


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Searches until there are --trials trials, or until interrupted."""
    need("optuna", "Optuna", "sweep")
    from optuna.exceptions import OptunaError
    from sqlalchemy.exc import SQLAlchemyError

    algorithm, env_id = arguments.algo, arguments.env_id
    kind, known = ALGORITHMS[algorithm], known_options(ALGORITHMS[algorithm])
    fixed: dict[str, Any] = {**key_values(arguments.params, "--params"), "env_id": env_id}
    if arguments.total_timesteps:
        fixed["total_timesteps"] = arguments.total_timesteps
    known.read(fixed, "--params")
    ranges = read_ranges(arguments.ranges, algorithm, env_id, known.names)
    ranges = {name: each for name, each in ranges.items() if name not in fixed}
    folder = (arguments.out or Path(f"runs/sweep__{as_file_name(env_id)}__{algorithm}")).resolve()
    sweep = Sweep(folder, algorithm, fixed, ranges, arguments.trials, arguments.seeds,
                  arguments.seed, arguments.pruner)  # fmt: skip
    choose(kind, sweep.flags({})[2:])  # checked here, else every trial would fail
    record = {"algorithm": algorithm, "options": fixed, "seeds": sweep.seeds, "seed": sweep.seed,
              "ranges": {name: repr(each) for name, each in ranges.items()}}  # fmt: skip
    with claimed(folder / RECORD, record, "search"):
        try:
            study = open_study(sweep)
            with job_pool(arguments, folder, interrupt) as pool:
                interrupt.defer()
                search(sweep, study, pool)
            write_best(folder, study, kind.section.format(env_id=env_id))
        except (OptunaError, SQLAlchemyError) as error:
            reason = str(error.__cause__ or error).split("\n")[0]
            raise WorkbenchError(f"{folder / STUDY} can't be read or written: {reason}") from error
    if interrupt.requested():
        tell("interrupted; run the same command again to continue")


def open_study(sweep: Sweep) -> Any:
    """Opens or creates the `optuna.Study` of a sweep; trials that were interrupted are enqueued again."""
    import optuna
    from optuna import pruners
    from optuna.trial import TrialState

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    # Other threads may write for long on a slow disk.
    options = {"connect_args": {"timeout": 60}}
    storage = optuna.storages.RDBStorage(f"sqlite:///{quote(str(sweep.folder / STUDY))}", options)
    study = optuna.create_study(storage=storage, study_name="sweep", direction="maximize",
                                load_if_exists=True)  # fmt: skip
    trials = study.get_trials(deepcopy=False)
    # With one seed alone a search that is continued would begin with the values that it has had.
    study.sampler = optuna.samplers.TPESampler(seed=sweep.seed + len(trials))
    kinds: dict[str, Any] = {"median": pruners.MedianPruner, "hyperband": pruners.HyperbandPruner}
    study.pruner = kinds.get(sweep.pruner, pruners.NopPruner)()
    for trial in trials:
        if trial.state == TrialState.RUNNING:
            study.enqueue_trial(trial.params, {"folder": _name(trial)})
            study.tell(trial.number, state=TrialState.FAIL)
    return study


def _name(trial: Any) -> str:
    """Returns a trial's folder: that of the first one with its options, if that was interrupted."""
    return str(trial.user_attrs.get("folder", f"trial_{trial.number:04d}"))


def _ended(study: Any) -> list[Any]:
    """Returns the trials with a result; those that were interrupted are enqueued again."""
    trials = study.get_trials(deepcopy=False)
    return [
        each
        for each in trials
        if each.value is not None or each.state.name == "PRUNED" or "failure" in each.user_attrs
    ]


def search(sweep: Sweep, study: Any, pool: Pool) -> None:
    """Runs trials until there are enough, or until the pool ends."""
    count = len(_ended(study))
    tell(f"{count} of {sweep.trials} trials are done: {sweep.folder}")
    lock = threading.Lock()  # over SQLite two threads could get the same enqueued trial

    def attempt(_: int) -> None:
        if not pool.is_over():
            with lock:
                trial = study.ask(sweep.ranges)
            _run(sweep, study, trial, pool)

    pool.map(attempt, range(count, sweep.trials))


def _run(sweep: Sweep, study: Any, trial: Any, pool: Pool) -> None:
    """Trains all seeds of a trial in turn; the first one decides whether it is pruned."""
    from optuna.trial import TrialState

    name, values, scores = _name(trial), trial.params, []
    judge = Judge(trial, sweep.folder / name / "seed_0")
    for seed in range(sweep.seeds):
        job = Job(sweep.folder, name, seed, sweep.flags(values))
        failure = pool.run(job, *([] if seed else [judge.is_promising]))
        if pool.is_over():
            return  # the trial stays a running one, which the next command continues
        if not judge.is_promising():
            tell(f"{name}: pruned after {judge.evaluations} evaluations, {values}")
            study.tell(trial, state=TrialState.PRUNED)
            return
        best = job.summary().get("best")
        if failure or not best:
            failure = failure or "never evaluated: eval_frequency is larger than its length"
            tell(f"{name} failed: {failure}")
            trial.set_user_attr("failure", failure)
            study.tell(trial, state=TrialState.FAIL)
            return
        scores.append(float(best[1]))
    study.tell(trial, sum(scores) / len(scores))
    tell(f"{name}: {sum(scores) / len(scores):.2f} with {values}")


class Judge:
    """Reports the evaluations of a trial's running training to Optuna; a step of Optuna's is one of them."""

    def __init__(self, trial: Any, folder: Path) -> None:
        self.evaluations = 0
        self._trial, self._folder, self._size = trial, folder, 0
        self._is_pruned = False

    def is_promising(self) -> bool:
        """Reports new evaluations; returns whether to continue the trial."""
        values: list[float] = []
        with contextlib.suppress(OSError, WorkbenchError):  # it can't be read now
            size = (self._folder / SCALARS).stat().st_size
            if size != self._size:
                values = curve_of(self._folder, EVALUATION).values[self.evaluations :].tolist()
                self._size = size
        for value in values:
            self.evaluations += 1
            self._trial.report(value, self.evaluations)
            self._is_pruned = self._trial.should_prune()
            if self._is_pruned:
                break
        return not self._is_pruned


def write_best(folder: Path, study: Any, section: str) -> None:
    """Writes best.yaml, and prints the best trial."""
    import yaml

    states = Counter(each.state.name.lower() for each in _ended(study))
    if not states["complete"]:
        tell("no trial has reached its end")
        return
    best, path = study.best_trial, folder / "best.yaml"
    write_file(path, as_text(yaml.safe_dump({section: dict(best.params)})))
    counts = ", ".join(f"{count} {state}" for state, count in states.items())
    tell(f"{counts}; best: {_name(best)}, {best.value:.2f}; its options are in {path}")


def read_ranges(path: Path | None, algorithm: str, env_id: str, known: list[str]) -> dict[str, Any]:
    """Reads Optuna's distributions for an algorithm in an environment, else those for the algorithm."""
    origin = path or default_file(RANGES)
    names = section_names(f"{algorithm} {{env_id}}", env_id)
    section = read_section(origin, (*names, algorithm), None)
    if not section:
        raise WorkbenchError(f"{origin} has no section {algorithm!r} nor {names[-1]!r}")
    for name in section:
        if name not in known:
            raise WorkbenchError(f"{origin}: {unknown('option', str(name), known)}")
    return {name: _distribution(value, f"{origin}: {name}") for name, value in section.items()}


def _distribution(value: Any, origin: str) -> Any:
    from optuna import distributions

    keys = ("low", "high", "log", "choices")
    given: dict[str, Any] = value if isinstance(value, dict) else {}
    for key in given:
        if key not in keys:
            raise WorkbenchError(f"{origin}: {unknown('key', str(key), list(keys))}")
    low, high = (given.get(key, "") for key in ("low", "high"))
    log, choices = bool(given.get("log")), given.get("choices")
    try:
        if isinstance(choices, list):
            if any(isinstance(each, list | dict) for each in choices):
                raise ValueError('choices are single values; sizes are a text, as in "64,64"')
            return distributions.CategoricalDistribution(choices)
        if type(low) is type(high) is int:
            return distributions.IntDistribution(low, high, log)
        if {type(low), type(high)} <= {int, float}:
            return distributions.FloatDistribution(low, high, log)
    except ValueError as error:
        raise WorkbenchError(f"{origin}: {error}") from error
    raise WorkbenchError(f"{origin} needs numbers low and high, or a list of choices, not {value!r}")
