"""`sweep`: Optuna searches for good options; every training has its own run folder.

FOLDER/sweep.json         the search's settings; the folder accepts no other search
FOLDER/study.db           Optuna's study; the same command continues it
FOLDER/trial_0000/seed_0  a training
FOLDER/trials.json        the trials and their scores
FOLDER/best.yaml          the best options, for --config
"""

import argparse
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rl_workbench.env_ids import as_file_name
from rl_workbench.errors import WorkbenchError, need
from rl_workbench.option import key_values, unknown
from rl_workbench.starting import Interrupt
from rl_workbench.storage import as_json, as_text, check_writable, write_file
from rl_workbench.tools.flags import add_job_flags, number
from rl_workbench.tools.jobs import Job
from rl_workbench.tools.pool import Pool, claim, job_pool
from rl_workbench.tools.runs import open_run
from rl_workbench.training import folder as run_folder
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options import (
    RunOptions,
    default_file,
    known_options,
    read_section,
    section_names,
)
from rl_workbench.training.progress import tell
from rl_workbench.training.scalar_log import EVALUATION
from rl_workbench.training.train import choose
from web_viewer.table import GrowingTable

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

    def record(self) -> dict[str, Any]:
        """Returns the settings that must stay the same when a search is continued."""
        ranges = {name: repr(each) for name, each in self.ranges.items()}
        return {"algorithm": self.algorithm, "options": self.options, "ranges": ranges,
                "seeds": self.seeds, "seed": self.seed}  # fmt: skip

    def flags(self, values: dict[str, Any]) -> list[str]:
        """Returns the flags of `train` for a trial, except name, seed and folder."""
        options = {**self.options, **values}
        pairs = [f"{key}={value}" for key, value in options.items()]
        return ["--algo", self.algorithm, "--params", *pairs]

    def run_options(self, values: dict[str, Any]) -> RunOptions:
        """Returns the run options of a trial."""
        return choose(ALGORITHMS[self.algorithm], self.flags(values)[2:]).run


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
    known.read(fixed, "--params")  # checked here, else every trial would fail
    ranges = read_ranges(arguments.ranges, algorithm, env_id, known.names)
    ranges = {name: each for name, each in ranges.items() if name not in fixed}
    folder = (arguments.out or Path(f"runs/sweep__{as_file_name(env_id)}__{algorithm}")).resolve()
    sweep = Sweep(folder, algorithm, fixed, ranges, arguments.trials, arguments.seeds,
                  arguments.seed, arguments.pruner)  # fmt: skip
    sweep.run_options({})
    check_writable(folder / RECORD)
    with run_folder.held(folder, "another search"):
        claim(folder, RECORD, sweep.record(), "a search with other options, ranges or seeds")
        try:
            study = open_study(sweep)
            with job_pool(arguments, folder, interrupt) as pool:
                interrupt.defer()
                search(sweep, study, pool)
            write_results(folder, study, kind.section.format(env_id=env_id))
        except (OptunaError, SQLAlchemyError) as error:
            reason = str(error.__cause__ or error).split("\n")[0]
            raise WorkbenchError(f"{folder / STUDY} can't be read or written: {reason}") from error
    if interrupt.requested():
        tell("interrupted; run the same command again to continue")


def open_study(sweep: Sweep) -> Any:
    """Opens or creates the `optuna.Study` of a sweep; trials that were interrupted are enqueued again."""
    import optuna
    from optuna.trial import TrialState

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    # Other threads may write for long on a slow disk.
    options = {"connect_args": {"timeout": 60}}
    storage = optuna.storages.RDBStorage(f"sqlite:///{sweep.folder / STUDY}", options)
    study = optuna.create_study(storage=storage, study_name="sweep", direction="maximize",
                                load_if_exists=True, pruner=_pruner(sweep))  # fmt: skip
    trials = study.get_trials(deepcopy=False)
    # With one seed alone a search that is continued would begin with the values that it has had.
    study.sampler = optuna.samplers.TPESampler(seed=sweep.seed + len(trials))
    for trial in trials:
        if trial.state == TrialState.RUNNING:
            study.enqueue_trial(trial.params, {"folder": _name(trial)})
            study.tell(trial.number, state=TrialState.FAIL)
    return study


def _pruner(sweep: Sweep) -> Any:
    from optuna import pruners

    if sweep.pruner == "hyperband":
        options = sweep.run_options({})
        least, length = max(options.eval_frequency, 1), options.total_timesteps
        return pruners.HyperbandPruner(least, max(length, least) if length else "auto")
    return pruners.MedianPruner() if sweep.pruner == "median" else pruners.NopPruner()


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
    with ThreadPoolExecutor(pool.at_once) as threads:
        list(threads.map(lambda _: _try(sweep, study, pool), range(count, sweep.trials)))


def _try(sweep: Sweep, study: Any, pool: Pool) -> None:
    """Trains all seeds of a trial in turn; the first one decides whether it is pruned."""
    from optuna.trial import TrialState

    if pool.is_over():
        return
    trial = study.ask(sweep.ranges)
    name, values, scores = _name(trial), trial.params, []
    judge = Judge(trial, sweep.folder / name / "seed_0", sweep.run_options(values).eval_frequency)
    for seed in range(sweep.seeds):
        flags = (f"--exp-name={name}", f"--seed={seed}", *sweep.flags(values))
        job = Job(f"{name}, seed {seed}", sweep.folder / name / f"seed_{seed}", flags)
        failure = pool.run(job, *([] if seed else [judge.is_promising]))
        if pool.is_over():
            return  # the trial stays a running one, which the next command continues
        if not judge.is_promising():
            tell(f"{name}: pruned at step {judge.last_step}, {values}")
            study.tell(trial, state=TrialState.PRUNED)
            return
        try:
            scores.append(score_of(job, failure))
        except WorkbenchError as error:
            tell(f"{name} failed: {error}")
            trial.set_user_attr("failure", str(error))
            study.tell(trial, state=TrialState.FAIL)
            return
    study.tell(trial, sum(scores) / len(scores))
    tell(f"{name}: {sum(scores) / len(scores):.2f} with {values}")


class Judge:
    """Reports the evaluations of a trial's running training, every `frequency` steps, to Optuna."""

    def __init__(self, trial: Any, folder: Path, frequency: int) -> None:
        self.last_step = 0  # of the last reported evaluation
        self._trial, self._frequency, self._table = trial, frequency, GrowingTable(folder)
        self._is_pruned = False

    def is_promising(self) -> bool:
        """Reports new evaluations; returns whether to continue the trial."""
        has_more = self._frequency > 0
        while has_more and not self._is_pruned:
            update = self._table.read()
            has_more = update.has_more
            for step, tag, value in update.points:
                # Episodes and vectors skip steps, so report the step at which the evaluation was due:
                # that one is comparable between trials.
                due = int(step) // max(self._frequency, 1) * self._frequency
                if tag == EVALUATION and due > self.last_step and not self._is_pruned:
                    self.last_step = due
                    self._trial.report(value, due)
                    self._is_pruned = self._trial.should_prune()
        return not self._is_pruned


def score_of(job: Job, failure: str) -> float:
    """Returns the mean return of the best evaluation."""
    if failure:
        raise WorkbenchError(failure)
    best = job.summary().get("best")
    if not best:
        open_run(job.folder)  # raises if the folder itself is damaged
        raise WorkbenchError(
            f"{job.folder} was never evaluated: eval_frequency is larger than its length"
        )
    return float(best[1])


def write_results(folder: Path, study: Any, section: str) -> None:
    """Writes trials.json and best.yaml, and prints the best trial."""
    import yaml

    rows = [
        {
            "folder": _name(trial),
            "state": trial.state.name.lower(),
            "score": trial.value,
            "options": trial.params,
            "failure": trial.user_attrs.get("failure"),
            "pruned_at": trial.last_step if trial.state.name == "PRUNED" else None,
        }
        for trial in _ended(study)
    ]
    write_file(folder / "trials.json", as_json(rows))
    states = Counter(row["state"] for row in rows)
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
    low: Any = given.get("low")
    high: Any = given.get("high")
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
    raise WorkbenchError(
        f"{origin} needs numbers low and high, or a list of choices, not {value!r}"
    )
