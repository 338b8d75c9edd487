"""What a training came to: its picture, its summary, and what the user is told of it."""

import contextlib
import shlex
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

from rl_workbench.errors import WorkbenchError
from rl_workbench.extras import replaying, watching
from rl_workbench.plotting.curves import learning_curve
from rl_workbench.plotting.figure import as_png
from rl_workbench.training.environments.checked import EnvironmentFailure
from rl_workbench.training.options.training_options import TrainingOptions
from rl_workbench.training.run.checkpoints import candidates
from rl_workbench.training.run.evaluator import Evaluation
from rl_workbench.training.run.files import as_json, write_atomically
from rl_workbench.training.run.folder import versions
from rl_workbench.training.run.history import LAST, WINDOW, History
from rl_workbench.training.run.progress import tell

TRACEBACK = "failure.txt"  # of an environment that failed


class TrainingOutcome(NamedTuple):
    """A training at its end, whatever ended it."""

    options: TrainingOptions
    folder: Path
    history: History
    steps: int
    is_complete: bool
    is_interrupted: bool
    evaluation: Evaluation | None  # the last one
    is_in_place: bool = True  # else another folder is where its own was

    def write(self, failure: str | None) -> None:
        """Writes learning_curve.png and summary.json.

        Raises:
            OSError: if the disk refuses.
        """
        history, run = self.history, self.options.run
        if history.returns:
            title = f"{self.options.kind.name}, {run.env_id}, seed {run.seed}"
            figure = learning_curve(history.lengths, history.returns, title, history.successes)
            write_atomically(self.folder / "learning_curve.png", as_png(figure))
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

    def tell(self) -> None:
        """Says how far it came, what it is worth, and what can be done with it."""
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
        tell(f"everything lies in {self.folder}")
        if self.is_interrupted:
            tell(f"interrupted{self._how_to_go_on()}")
        tell(f"watch: {replaying(self.folder)}")
        tell(f"curves: {watching(self.folder)}")

    def what_is_left(self, is_written: bool) -> str:
        """Of a training that failed.

        Args:
            is_written: whether all could be written.
        """
        text = f"stopped after {self.steps} steps, {len(self.history.returns)} episodes"
        if is_written:
            text += f", what was learned is saved in {self.folder}"
        return text + self._how_to_go_on()

    def _how_to_go_on(self) -> str:
        if not self.is_in_place or not candidates(self.folder):
            return ""
        return f"; --resume {shlex.quote(str(self.folder))} goes on from the last checkpoint"


def write_traceback(folder: Path, failure: WorkbenchError) -> str:
    """Writes that of an environment's own code into the folder; returns the words for it."""
    if not isinstance(failure, EnvironmentFailure):
        return ""
    path, text = folder / TRACEBACK, "".join(traceback.format_exception(failure.__cause__))
    with contextlib.suppress(OSError):  # what can't be written isn't what the user has to hear of
        write_atomically(path, lambda stream: stream.write(text.encode(errors="replace")))
        return f"; the traceback is in {path}"
    return ""


def _mean(values: list[float] | list[int]) -> float | None:
    return sum(values) / len(values) if values else None
