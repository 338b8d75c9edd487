"""`sweep`: Optuna searches for good options; every training has its own run folder.

FOLDER/sweep.json         the search's settings; the folder accepts no other search
FOLDER/study.journal      the study; the same command continues it
FOLDER/trial_0000/seed_0  a training
FOLDER/trials.json        the trials and their scores
FOLDER/best.yaml          the best options, for --config
"""

import argparse
import contextlib
import os
import zlib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rl_workbench.env_ids import as_file_name
from rl_workbench.errors import WorkbenchError, need
from rl_workbench.option import key_values
from rl_workbench.starting import Interrupt
from rl_workbench.storage import as_json, as_text, check_writable, write_file
from rl_workbench.tools.flags import add_job_flags, number
from rl_workbench.tools.job import Job
from rl_workbench.tools.jobs import JobPool, claim, job_pool
from rl_workbench.tools.ranges import OptionRange, read_ranges
from rl_workbench.tools.runs import open_run
from rl_workbench.training import folder as run_folder
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options import RunOptions, known_options
from rl_workbench.training.progress import tell
from rl_workbench.training.scalar_log import EVALUATION
from rl_workbench.training.train import choose
from web_viewer.table import GrowingTable

RECORD, JOURNAL, STUDY = "sweep.json", "study.journal", "sweep"
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
    ranges: "dict[str, OptionRange]"
    trials: int  # in all, including those of earlier commands
    seeds: int  # trainings of one trial
    seed: int  # of the search
    pruner: str
    section: str  # of best.yaml

    def record(self) -> dict[str, Any]:
        """Returns the settings that must stay the same when a search is continued."""
        ranges = {name: each._asdict() for name, each in self.ranges.items()}
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
    algorithm, env_id = arguments.algo, arguments.env_id
    kind, known = ALGORITHMS[algorithm], known_options(ALGORITHMS[algorithm])
    fixed: dict[str, Any] = {**key_values(arguments.params, "--params"), "env_id": env_id}
    if arguments.total_timesteps:
        fixed["total_timesteps"] = arguments.total_timesteps
    known.read(fixed, "--params")  # checked here, else every trial would fail
    ranges = read_ranges(arguments.ranges, algorithm, env_id, known.names)
    ranges = {name: each for name, each in ranges.items() if name not in fixed}
    folder = (arguments.out or Path(f"runs/sweep__{as_file_name(env_id)}__{algorithm}")).resolve()
    sweep = Sweep(
        folder, algorithm, fixed, ranges, arguments.trials, arguments.seeds,
        arguments.seed, arguments.pruner, kind.section.format(env_id=env_id),
    )  # fmt: skip
    sweep.run_options({})
    check_writable(folder / RECORD)
    with run_folder.held(folder, "another search"):
        claim(folder, RECORD, sweep.record(), "a search with other options, ranges or seeds")
        try:
            study = open_study(sweep)
            with job_pool(arguments, folder, interrupt) as pool:
                interrupt.defer()
                Search(sweep, study, pool, interrupt).run()
            write_results(sweep, study)
        except OSError as error:  # of Optuna's journal
            raise WorkbenchError(f"can't write to {folder}: {error.strerror}") from error
    if interrupt.requested():
        tell("interrupted; run the same command again to continue")


def open_study(sweep: Sweep) -> Any:
    """Opens or creates the `optuna.Study` of a sweep."""
    import optuna
    from optuna.storages.journal import JournalFileBackend

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    path = sweep.folder / JOURNAL
    _repair(path)
    try:
        return optuna.create_study(
            storage=optuna.storages.JournalStorage(JournalFileBackend(str(path))),
            study_name=STUDY,
            direction="maximize",
            load_if_exists=True,
            sampler=_seeded_sampler(sweep.seed),
            pruner=_pruner(sweep),
        )
    except OSError:
        raise
    except Exception as error:
        raise WorkbenchError(f"{path} isn't a study that can be used") from error


def _repair(path: Path) -> None:
    """Repairs the journal of a killed search: removes its stale lock and a partial last line."""
    path.with_name(f"{path.name}.lock").unlink(missing_ok=True)
    with contextlib.suppress(FileNotFoundError):
        content = path.read_bytes()
        whole = content.rfind(b"\n") + 1
        if not whole and content[:1] not in (b"", b"{"):
            raise WorkbenchError(f"{path} isn't a study that can be used")
        os.truncate(path, whole)


def _seeded_sampler(seed: int) -> Any:
    """Returns TPE seeded by trial and option alone, so that a resumed search draws the same values."""
    import numpy as np
    from optuna.samplers import BaseSampler, TPESampler

    class SeededSampler(BaseSampler):
        def infer_relative_search_space(self, study: Any, trial: Any) -> dict[str, Any]:
            return {}

        def sample_relative(self, study: Any, trial: Any, search_space: Any) -> dict[str, Any]:
            return {}

        def sample_independent(self, study: Any, trial: Any, name: str, distribution: Any) -> Any:
            entropy = (seed, trial.number, zlib.crc32(name.encode()))
            (own,) = np.random.SeedSequence(entropy).generate_state(1)
            sampler = TPESampler(seed=int(own))
            return sampler.sample_independent(study, trial, name, distribution)

    return SeededSampler()


def _pruner(sweep: Sweep) -> Any:
    from optuna import pruners

    if sweep.pruner == "hyperband":
        options = sweep.run_options({})
        least, length = max(options.eval_frequency, 1), options.total_timesteps
        return pruners.HyperbandPruner(least, max(length, least) if length else "auto")
    return pruners.MedianPruner() if sweep.pruner == "median" else pruners.NopPruner()


class SearchInterrupted(Exception):
    """The search ends; its running trials can be continued."""


class Search:
    """Runs the trials of a study. An interrupt ends it; the next command continues the running trials."""

    def __init__(self, sweep: Sweep, study: Any, pool: JobPool, interrupt: Interrupt) -> None:
        self._sweep, self._study, self._pool, self._interrupt = sweep, study, pool, interrupt

    def run(self) -> None:
        """Finishes the trials that an earlier command left, then makes new ones."""
        from optuna.trial import Trial, TrialState

        trials = self._study.get_trials(deepcopy=False)
        left = [each._trial_id for each in trials if each.state == TrialState.RUNNING]
        sweep = self._sweep
        tell(f"{len(trials) - len(left)} of {sweep.trials} trials are done: {sweep.folder}")
        with contextlib.suppress(SearchInterrupted):
            with ThreadPoolExecutor(self._pool.at_once) as threads:
                list(threads.map(lambda number: self._finish(Trial(self._study, number)), left))
            with ThreadPoolExecutor(self._pool.at_once) as threads:
                list(threads.map(self._try, range(len(trials), sweep.trials)))

    def _try(self, _: int) -> None:
        if self._interrupt.requested():
            raise SearchInterrupted
        self._finish(self._study.ask())

    def _finish(self, trial: Any) -> None:
        from optuna import TrialPruned
        from optuna.trial import TrialState

        try:
            self._study.tell(trial, self._objective(trial))
        except TrialPruned:
            self._study.tell(trial, state=TrialState.PRUNED)
        except WorkbenchError:
            self._study.tell(trial, state=TrialState.FAIL)

    def _objective(self, trial: Any) -> float:
        """Trains all seeds of a trial in turn; the first one decides whether it is pruned."""
        import optuna

        sweep = self._sweep
        values = {name: each.suggest(trial, name) for name, each in sweep.ranges.items()}
        name = f"trial_{trial.number:04d}"
        frequency = sweep.run_options(values).eval_frequency
        judge = Judge(self._study, trial, sweep.folder / name / "seed_0", frequency)
        scores = []
        try:
            for seed in range(sweep.seeds):
                flags = (f"--exp-name={name}", f"--seed={seed}", *sweep.flags(values))
                job = Job(f"{name}, seed {seed}", sweep.folder / name / f"seed_{seed}", flags)
                failure = self._pool.run(job, *([] if seed else [judge.is_promising]))
                if self._interrupt.requested():
                    raise SearchInterrupted
                if not seed and not judge.is_promising():
                    tell(f"trial {trial.number}: pruned at step {judge.last_step}, {values}")
                    raise optuna.TrialPruned
                if failure:
                    raise WorkbenchError(failure)
                scores.append(score_of(job))
        except WorkbenchError as error:
            trial.set_user_attr("failure", str(error))
            tell(f"trial {trial.number} failed: {error}")
            raise
        score = sum(scores) / len(scores)
        tell(f"trial {trial.number}: {score:.2f} with {values}")
        return score


class Judge:
    """Reports the evaluations of a trial's running training, every `frequency` steps, to Optuna."""

    def __init__(self, study: Any, trial: Any, folder: Path, frequency: int) -> None:
        self._trial, self._frequency = trial, frequency
        self._table = GrowingTable(folder)
        known = study.get_trials(deepcopy=False)[trial.number].intermediate_values
        self._steps = set(known)
        self._is_pruned = bool(known) and trial.should_prune()

    @property
    def last_step(self) -> int:
        """The step of the last reported evaluation."""
        return max(self._steps, default=0)

    def is_promising(self) -> bool:
        """Reports new evaluations; returns whether to continue the trial."""
        has_more = True
        while has_more:
            update = self._table.read()
            has_more = update.has_more
            for step, tag, value in update.points:
                if tag == EVALUATION and self._frequency and not self._is_pruned:
                    # Episodes and vectors skip steps, so report the step at which the evaluation was due:
                    # that one is comparable between trials.
                    due = int(step) // self._frequency * self._frequency
                    if due not in self._steps:
                        self._steps.add(due)
                        self._trial.report(value, due)
                        self._is_pruned = self._trial.should_prune()
        return not self._is_pruned


def score_of(job: Job) -> float:
    """Returns the mean return of the best evaluation."""
    summary = job.summary()
    if summary.get("best"):
        return float(summary["best"][1])
    open_run(job.folder)  # raises if the folder itself is damaged
    raise WorkbenchError(
        f"{job.folder} was never evaluated: eval_frequency is larger than its length"
    )


def write_results(sweep: Sweep, study: Any) -> None:
    """Writes trials.json and best.yaml, and prints the best trial."""
    import yaml
    from optuna.trial import TrialState

    trials = study.get_trials(deepcopy=False)
    rows = [
        {
            "number": trial.number,
            "state": trial.state.name.lower(),
            "score": trial.value,
            "options": trial.params,
            "failure": trial.user_attrs.get("failure"),
            "pruned_at": trial.last_step if trial.state == TrialState.PRUNED else None,
        }
        for trial in trials
    ]
    write_file(sweep.folder / "trials.json", as_json(rows))
    if not any(trial.state == TrialState.COMPLETE for trial in trials):
        tell("no trial has reached its end")
        return
    best, path = study.best_trial, sweep.folder / "best.yaml"
    write_file(path, as_text(yaml.safe_dump({sweep.section: dict(best.params)})))
    states = Counter(row["state"] for row in rows)
    counts = ", ".join(f"{count} {state}" for state, count in states.items())
    tell(f"{counts}; best: trial {best.number}, {best.value:.2f}; its options are in {path}")
