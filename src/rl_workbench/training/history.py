"""A training's history of episodes and evaluations, and its report at the end."""

import contextlib
import math
import shlex
import traceback
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import torch

from rl_workbench import errors
from rl_workbench.errors import EnvironmentFailure, WorkbenchError
from rl_workbench.storage import as_json, write_atomically
from rl_workbench.training.checkpoints import candidates
from rl_workbench.training.evaluator import Evaluation
from rl_workbench.training.folder import versions
from rl_workbench.training.options import RunOptions, TrainingOptions
from rl_workbench.training.progress import tell

WINDOW = 20  # [episodes] of the mean length
LAST = 100  # [episodes] of the success rate and of the summary's mean return
TRACEBACK = "failure.txt"


@dataclass
class History:
    """Episodes, evaluations and wall time of a training."""

    returns: list[float] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)
    successes: list[bool] = field(default_factory=list)  # of the episodes that say so
    evaluations: list[tuple[int, float]] = field(default_factory=list)  # step, mean return
    best: tuple[int, float] | None = None  # of the evaluations
    seconds: float = 0.0  # of wall time

    @property
    def best_return(self) -> float:
        """The mean return of the best evaluation; minus infinity before the first."""
        return self.best[1] if self.best else -math.inf

    @property
    def success_rate(self) -> float:
        """The share of successes in the last 100 episodes that say so; there is at least one."""
        recent = self.successes[-LAST:]
        return sum(recent) / len(recent)

    def was_evaluated(self, steps: int) -> bool:
        """Returns whether the last evaluation was at this step."""
        return bool(self.evaluations) and self.evaluations[-1][0] == steps

    def is_complete(self, run: RunOptions, steps: int) -> bool:
        """Returns whether the training is at its end, after `steps` with those of an unfinished episode."""
        recent = self.lengths[-WINDOW:]
        return (
            bool(run.total_timesteps and steps >= run.total_timesteps)
            or bool(run.episodes and len(self.returns) >= run.episodes)
            or (run.stop_at_return is not None and self.best_return >= run.stop_at_return)
            or (
                bool(run.stop_at_length)
                and len(recent) == WINDOW
                and sum(recent) >= run.stop_at_length * WINDOW
            )
        )

    def state_dict(self) -> dict[str, Any]:
        """Returns plain numbers and tensors."""
        return {
            "returns": torch.tensor(self.returns, dtype=torch.float64),
            "lengths": torch.tensor(self.lengths, dtype=torch.int64),
            "successes": torch.tensor(self.successes, dtype=torch.bool),
            "evaluations": [list(each) for each in self.evaluations],
            "best": None if self.best is None else list(self.best),
            "seconds": self.seconds,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Loads what `state_dict` returned."""
        self.returns = state["returns"].tolist()
        self.lengths = state["lengths"].tolist()
        self.successes = state["successes"].tolist()
        self.evaluations = [evaluation_of(each) for each in state["evaluations"]]
        self.best = None if state["best"] is None else evaluation_of(state["best"])
        self.seconds = float(state["seconds"])


def evaluation_of(state: Any) -> tuple[int, float]:
    """Returns step and mean return from a checkpoint."""
    step, mean = state
    return int(step), float(mean)


class Outcome(NamedTuple):
    """The outcome of a training."""

    options: TrainingOptions
    folder: Path
    history: History
    steps: int
    is_complete: bool
    is_interrupted: bool
    evaluation: Evaluation | None  # the last one
    is_in_place: bool  # else the run folder was moved or removed

    def write_summary(self, failure: str | None) -> None:
        """Writes summary.json."""
        history = self.history
        summary = {
            **self.options.record(),
            "versions": versions(),
            "failure": failure,
            "complete": self.is_complete,
            "interrupted": self.is_interrupted,
            "episodes": len(history.returns),
            "steps": self.steps,
            "seconds": round(history.seconds, 3),
            f"mean_return_last_{LAST}": _mean(history.returns[-LAST:]),
            f"mean_length_last_{WINDOW}": _mean(history.lengths[-WINDOW:]),
            f"success_rate_last_{LAST}": history.success_rate if history.successes else None,
            "best": history.best,
            "evaluations": history.evaluations,
            "evaluation": asdict(self.evaluation) if self.evaluation else None,
            "lengths": history.lengths,
            "returns": history.returns,
            "successes": history.successes,
        }
        write_atomically(self.folder / "summary.json", as_json(summary))

    def report(self) -> None:
        """Prints how far it came, how good the policy is, and what to do with it."""
        history, evaluation = self.history, self.evaluation
        line = f"trained {len(history.returns)} episodes, {self.steps} steps in "
        line += f"{history.seconds:.1f} s"
        if history.best:
            line += f"; best evaluation {history.best[1]:.1f} at step {history.best[0]}"
        if evaluation:
            line += f"; the last one over {len(evaluation.lengths)} greedy episodes: length "
            line += f"{evaluation.mean_length:.1f}, return {evaluation.mean_return:.1f}"
            if evaluation.success_rate is not None:
                line += f", success {evaluation.success_rate:.0%}"
        tell(line)
        if not self.is_in_place:
            return
        tell(f"all results are in {self.folder}")
        if self.is_interrupted:
            tell(f"interrupted{self._how_to_resume()}")
        hints, folder = errors.hints, str(self.folder)
        tell(f"evaluate: {shlex.join([*hints.workbench, 'eval', folder])}")
        tell(f"watch: {shlex.join([*hints.workbench, 'view', folder])}")
        tell(f"curves: {shlex.join([*hints.tensorboard, '--logdir', folder])}")

    def failure_text(self, failure: WorkbenchError, saved_at: int) -> str:
        """Returns the line for a training that failed; its last checkpoint is of `saved_at`, -1 for none."""
        text = f"{failure}{_write_traceback(self.folder, failure)}; stopped after {self.steps} steps, "
        text += f"{len(self.history.returns)} episodes"
        if saved_at >= 0:
            until = "" if saved_at == self.steps else f" up to step {saved_at}"
            text += f", progress{until} is saved in {self.folder}"
        return text + self._how_to_resume()

    def _how_to_resume(self) -> str:
        if not self.is_in_place or not candidates(self.folder):
            return ""
        return f"; --resume {shlex.quote(str(self.folder))} continues from the last checkpoint"


def _write_traceback(folder: Path, failure: WorkbenchError) -> str:
    """Writes the traceback of an environment's or a callback's own code into the folder."""
    if not isinstance(failure, EnvironmentFailure):
        return ""
    path, text = folder / TRACEBACK, "".join(traceback.format_exception(failure.__cause__))
    with contextlib.suppress(OSError):  # the user needs to hear of the failure, not of this
        write_atomically(path, lambda stream: stream.write(text.encode(errors="replace")))
        return f"; the traceback is in {path}"
    return ""


def _mean(values: list[float] | list[int]) -> float | None:
    return sum(values) / len(values) if values else None
