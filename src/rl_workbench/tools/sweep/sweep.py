"""`sweep`: Optuna looks for good options; every training is a run folder of its own.

FOLDER/sweep.json        what is searched; the same folder takes no other search
FOLDER/study.journal     the study; calling again with the same folder goes on with it
FOLDER/trial_0000/seed_0 a training, and what it said beside it
FOLDER/trials.json       what was tried, and how it went
FOLDER/best.yaml         the best options, for --config
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from tqdm import tqdm

from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import as_json, as_text, write_file
from rl_workbench.tools.jobs.job import Job
from rl_workbench.tools.jobs.runner import Watch
from rl_workbench.tools.sweep.ranges import Range
from rl_workbench.tools.sweep.study import Study, Trial
from rl_workbench.tools.sweep.trainings import Evaluations, score_of, training
from rl_workbench.training.progress import tell


@dataclass(frozen=True)
class Sweep:
    """What is searched, and how much."""

    folder: Path
    algorithm: str
    options: dict[str, Any]  # of every training
    ranges: dict[str, Range]
    trials: int  # in all, those of earlier calls included
    seeds: int  # trainings of one trial; its score is their mean
    section: str  # of best.yaml


class _Begun:
    """A trial of which a training runs, or will.

    It is judged by its first seed: where that one falls behind, or any fails, the others are ended.
    """

    def __init__(self, trial: Trial, jobs: list[Job], evaluations: Evaluations) -> None:
        self.trial, self.jobs, self._evaluations = trial, jobs, evaluations
        self.open = set(jobs)  # that haven't ended
        self.failure = ""

    def look(self) -> None:
        """Takes down what the first seed's evaluations have found since the last look."""
        for step, value in self._evaluations.new():
            self.trial.report(step, value)

    @property
    def is_decided(self) -> bool:
        """Whether nobody needs what its trainings still would find."""
        return self.trial.falls_behind or bool(self.failure)

    def score(self) -> float:
        """The mean of the seeds.

        Raises:
            WorkbenchError: if one has no score.
        """
        return float(np.mean([score_of(job) for job in self.jobs]))


class Search(Watch):
    """Makes trials of a study, and learns from their trainings what they are worth.

    Args:
        sweep: what is wanted.
        study: gets what was found; what a search that was ended has left unfinished goes on first.
        frequency: how many steps there are between two evaluations, for the values of a trial.
        in_turn: no trial begins before all earlier ones have come to their end, also where one has to be
            tried again; so the same search makes the same trials.
    """

    def __init__(
        self,
        sweep: Sweep,
        study: Study,
        frequency: Callable[[dict[str, Any]], int],
        in_turn: bool,
    ) -> None:
        self._sweep, self._study, self._frequency = sweep, study, frequency
        self._in_turn = in_turn
        self._begun: dict[Job, _Begun] = {}

    def jobs(self) -> Iterator[Job | None]:
        """All trainings, each asked for when there is room for it; None: there is none at the moment."""
        for trial in self._trials():
            begun = self._begin(trial)
            self._begun.update(dict.fromkeys(begun.jobs, begun))
            for job in begun.jobs:
                if begun.is_decided:
                    self.ended(job, "")
                else:
                    yield job
            while self._in_turn and begun.open:
                yield None

    def _trials(self) -> Iterator[Trial]:
        yield from self._study.unfinished()
        while len(self._study) < self._sweep.trials:
            yield self._study.next()

    def _begin(self, trial: Trial) -> _Begun:
        sweep, options = self._sweep, {**self._sweep.options, **trial.values}
        name = f"trial_{trial.number:04d}"
        jobs = [
            training(sweep.folder / name / f"seed_{seed}", sweep.algorithm, options, name, seed)
            for seed in range(sweep.seeds)
        ]
        return _Begun(trial, jobs, Evaluations(jobs[0].folder, self._frequency(trial.values)))

    def is_unwanted(self, job: Job) -> bool:
        """See Watch."""
        begun = self._begun[job]
        if job == begun.jobs[0]:
            begun.look()  # where folders are shared nobody tells that they have changed
        return begun.is_decided

    def skipped(self, job: Job) -> None:
        """See Watch."""
        self.ended(job, "")

    def ended(self, job: Job, failure: str) -> None:
        """See Watch."""
        begun = self._begun[job]
        if job == begun.jobs[0]:
            begun.look()  # also if it was over before anybody has looked
        if not begun.trial.falls_behind:
            begun.failure = begun.failure or failure
        begun.open.discard(job)
        if not begun.open:
            self._take_down(begun)

    def _take_down(self, begun: _Begun) -> None:
        """What a trial came to; one that fails is noted and costs no other."""
        trial, study = begun.trial, self._study
        try:
            if trial.falls_behind:
                study.prune(trial)
                _say(f"trial {trial.number}: pruned at step {trial.last_step}, {trial.values}")
                return
            if begun.failure:
                raise WorkbenchError(begun.failure)
            score = begun.score()
        except WorkbenchError as error:
            study.fail(trial, str(error))
            _say(f"trial {trial.number} failed: {error}")
        else:
            study.complete(trial, score)
            _say(f"trial {trial.number}: {score:.2f} with {trial.values}")


def _say(text: str) -> None:
    """Tells it above the bars that are shown, if they are."""
    with tqdm.external_write_mode():
        tell(text)


def write_results(sweep: Sweep, study: Study) -> None:
    """trials.json and best.yaml."""
    write_file(sweep.folder / "trials.json", as_json(study.rows()))
    best = study.best()
    if best is None:
        tell("no trial came to its end")
        return
    number, score, options = best
    write_file(sweep.folder / "best.yaml", as_text(yaml.safe_dump({sweep.section: options})))
    counts = ", ".join(f"{count} {state}" for state, count in study.counts().items())
    place = sweep.folder / "best.yaml"
    tell(f"{counts}; best: trial {number}, {score:.2f}; its options are in {place}")
