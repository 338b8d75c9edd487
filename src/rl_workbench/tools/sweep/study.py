"""What a sweep has tried, on disk: Optuna's study in a journal, which a kill at any moment leaves whole.

Each line of the journal is one change. Its lock is a link beside it, which file systems of a network
know as well; a database's locks many of them don't.
"""

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.sweep.ranges import Range

JOURNAL, NAME = "study.journal", "sweep"
JUDGED = b'"completed_rung_'  # in a line of the journal
PRUNERS = ("median", "hyperband", "none")


class Pruner(NamedTuple):
    """How trials are judged by their evaluations."""

    name: str  # one of PRUNERS
    between: int  # environment steps between two evaluations
    total: int  # environment steps of a training; 0 if that isn't known

    def optunas(self) -> Any:
        """Optuna's own."""
        from optuna import pruners

        if self.name == "median":
            return pruners.MedianPruner()
        if self.name == "hyperband":
            least = max(self.between, 1)
            return pruners.HyperbandPruner(least, max(self.total, least) if self.total else "auto")
        return pruners.NopPruner()


class Trial:
    """One choice of options, and what its evaluations have shown so far.

    Args:
        trial: Optuna's.
        ranges: what is chosen from; what was chosen before a kill stays.
        seed: of the search.
    """

    def __init__(self, trial: Any, ranges: dict[str, Range], seed: int) -> None:
        self._trial = trial
        self.number: int = trial.number
        self.values: dict[str, Any] = {}
        for index, (name, each) in enumerate(ranges.items()):
            trial.study.sampler = _sampler(seed, self.number, index)
            self.values[name] = each.suggest(trial, name)
        known = trial.storage.get_trial(trial._trial_id).intermediate_values
        self._steps = set(known)
        self.falls_behind: bool = bool(known) and trial.should_prune()

    def report(self, step: int, value: float) -> None:
        """Takes down an evaluation; what comes after the one that sealed the trial's fate isn't asked for."""
        if self.falls_behind or step in self._steps:
            return
        self._steps.add(step)
        self._trial.report(value, step)
        self.falls_behind = self._trial.should_prune()

    @property
    def last_step(self) -> int:
        """Of the last evaluation that was taken down."""
        return max(self._steps, default=0)


class Study:
    """The trials of a folder.

    Args:
        folder: is there, and this process's alone.
        ranges: what is searched.
        seed: of the search.
        pruner: ends trials that fall behind.

    Raises:
        WorkbenchError: if the folder has another search, or one that can't be read.
    """

    def __init__(self, folder: Path, ranges: dict[str, Range], seed: int, pruner: Pruner) -> None:
        import optuna
        from optuna.storages.journal import JournalFileBackend

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._ranges, self._seed = ranges, seed
        self._states = optuna.trial.TrialState
        path = folder / JOURNAL
        _cut(path)
        try:
            storage = optuna.storages.JournalStorage(JournalFileBackend(str(path)))
            self._study = optuna.create_study(
                storage=storage,
                study_name=NAME,
                direction="maximize",
                load_if_exists=True,
                pruner=pruner.optunas(),
            )
        except (
            optuna.exceptions.OptunaError,
            ValueError,
            LookupError,
            TypeError,
            AssertionError,
        ) as error:  # the last of a line that it does not know
            raise WorkbenchError(f"{path} isn't a study that can be used") from error

    def __len__(self) -> int:
        return len(self._study.get_trials(deepcopy=False))

    def ended(self) -> int:
        """How many trials nothing is left to do for."""
        return len(self) - self.counts().get("running", 0)

    def counts(self) -> dict[str, int]:
        """How many trials there are of each state."""
        found: dict[str, int] = {}
        for trial in self._study.get_trials(deepcopy=False):
            name = trial.state.name.lower()
            found[name] = found.get(name, 0) + 1
        return found

    def unfinished(self) -> list[Trial]:
        """Those that a search that was ended has left behind; by number."""
        from optuna.trial import Trial as Optunas

        left = self._study.get_trials(deepcopy=False, states=[self._states.RUNNING])
        return [self._trial(Optunas(self._study, each._trial_id)) for each in left]

    def next(self) -> Trial:
        """A new one, by all that are known to have come to an end."""
        return self._trial(self._study.ask())

    def _trial(self, trial: Any) -> Trial:
        return Trial(trial, self._ranges, self._seed)

    def complete(self, trial: Trial, score: float) -> None:
        """It came to its end."""
        self._study.tell(trial.number, score)

    def prune(self, trial: Trial) -> None:
        """It fell behind; its last evaluation is its value."""
        self._study.tell(trial.number, state=self._states.PRUNED)

    def fail(self, trial: Trial, why: str) -> None:
        """It has none."""
        trial._trial.set_user_attr("failure", why)
        self._study.tell(trial.number, state=self._states.FAIL)

    def rows(self) -> list[dict[str, Any]]:
        """What was tried, and how it went."""
        pruned = self._states.PRUNED
        return [
            {
                "number": trial.number,
                "state": trial.state.name.lower(),
                "score": trial.value,
                "options": trial.params,
                "failure": trial.user_attrs.get("failure"),
                "pruned_at": trial.last_step if trial.state == pruned else None,
            }
            for trial in self._study.get_trials(deepcopy=False)
        ]

    def best(self) -> tuple[int, float, dict[str, Any]] | None:
        """Number, score and options of the best trial that came to its end."""
        if not self._study.get_trials(deepcopy=False, states=[self._states.COMPLETE]):
            return None
        trial = self._study.best_trial
        return trial.number, self._study.best_value, dict(trial.params)


def _sampler(seed: int, trial: int, option: int) -> Any:
    """Each option of each trial has draws of its own: a search that goes on draws what it would have."""
    from optuna.samplers import TPESampler

    (own,) = np.random.SeedSequence((seed, trial, option)).generate_state(1)
    return TPESampler(seed=int(own))


def _cut(path: Path) -> None:
    """Takes away what a kill has left half done: the end of a line, a judgement, the lock of who wrote."""
    try:
        path.with_name(f"{path.name}.lock").unlink(missing_ok=True)
        *lines, end = path.read_bytes().splitlines(keepends=True) or [b""]
        if end.endswith(b"\n"):
            lines.append(end)
        elif end and not end.startswith(b"{"):
            raise WorkbenchError(f"{path} isn't a study that can be used")
        # Hyperband notes whom it has judged, and judges nobody twice; the verdict is another line.
        while lines and JUDGED in lines[-1]:
            lines.pop()
        os.truncate(path, sum(map(len, lines)))
    except FileNotFoundError:
        pass
    except OSError as error:
        raise WorkbenchError(f"can't read {path}: {error.strerror}") from error
