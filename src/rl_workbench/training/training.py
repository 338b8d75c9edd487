"""The frame of every training: open or resume a folder, learn, evaluate, keep the best, save, tell."""

import contextlib
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.states import whole
from rl_workbench.storage import read_record
from rl_workbench.training import folder as run_folder
from rl_workbench.training.algorithm import make_algorithm
from rl_workbench.training.checkpoints import Checkpoints, candidates, fitting, read_newest
from rl_workbench.training.evaluator import Evaluation, Evaluator
from rl_workbench.training.generators import random_states, restore_random_states, seed_all
from rl_workbench.training.history import History, TrainingOutcome, evaluation_of, write_traceback
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.progress import Progress, tell
from rl_workbench.training.scalar_log import (
    CONFIRMED,
    EVAL_SUCCESS,
    EVALUATION,
    RETURN,
    SUCCESS,
    ScalarLog,
)

AT_THE_END = "best_at_the_end"  # of a checkpoint: the score of its evaluation after it, if the best


class Training:
    """One training; new, or resumed from its folder.

    Args:
        options: what the user chose.
        folder: an empty folder for all results, or the one of the resumed training.
        interrupt: tells when to stop.

    Raises:
        WorkbenchError: if the environment can't be made or doesn't suit, or there is nothing
            to resume from.
    """

    log: ScalarLog

    def __init__(self, options: TrainingOptions, folder: Path, interrupt: Interrupt) -> None:
        torch.set_num_threads(1)  # networks this small only lose by more
        self._options, self._run = options, options.run
        self.folder, self._interrupt = folder, interrupt
        self._checkpoints = Checkpoints(folder, self._run.keep_checkpoints)
        self._history, self._log_bytes = History(), 0
        self._resumed = self._read_checkpoint() if options.resume else None
        seed_all(self._run.seed)
        with contextlib.ExitStack() as making:
            self._algorithm = make_algorithm(options)
            making.callback(self._algorithm.close)
            self._evaluator = Evaluator(options, self._algorithm, interrupt.requested, tell)
            making.callback(self._evaluator.close)
            if self._resumed:
                self._take_over(self._resumed)
            making.pop_all()
        self._saved_at = -1  # [steps]
        self._is_written = True  # whatever was to be
        self._evaluation: Evaluation | None = None  # the one at the end
        self._shown: Progress
        self._began, self._first_step = time.monotonic(), self._algorithm.steps
        self._seconds_before = self._history.seconds

    def _read_checkpoint(self) -> dict[str, Any] | None:
        """None if the training was killed before its first checkpoint: it begins anew."""
        if not candidates(self.folder):
            tell(f"{self.folder} has no checkpoint yet; beginning anew")
            return None
        content = read_newest(self.folder, tell)
        self._options.check_same(content.get("config"), str(self.folder))
        return content

    def _take_over(self, content: dict[str, Any]) -> None:
        """All but the environment's state, which needs it to be seeded."""
        self._algorithm.load_state_dict(content)
        with fitting("history"):
            self._history.load_state_dict(content["history"])
            self._log_bytes = whole(content["log_bytes"])
        with fitting("state of the random generators"):
            restore_random_states(content["random"])

    # --- the course of a training ---------------------------------------------------------------

    def run(self) -> None:
        """Trains and writes everything; what was learned is saved also when it fails.

        Raises:
            WorkbenchError: if the disk, the environment or the arithmetic fails.
        """
        failure: WorkbenchError | None = None
        try:
            self._train()
        except WorkbenchError as error:
            failure = error
        except (OSError, MemoryError) as error:
            failure = self._not_written(error)
        finally:
            failure = self._close(failure)
        self._finish(failure)

    def _close(self, failure: WorkbenchError | None) -> WorkbenchError | None:
        """Closes the environments; returns the first failure."""
        for part in (self._evaluator, self._algorithm):
            try:
                part.close()
            except WorkbenchError as error:
                failure = failure or error
        return failure

    def _train(self) -> None:
        self._checkpoints.remove_leftovers()
        record = self._options.record()
        run_folder.write_record(self.folder, record, bool(self._resumed))
        settings = {**record["run"], **record["hyperparameters"]}
        self.log = ScalarLog(self.folder, settings, self._log_bytes, tell)
        self._shown = self._make_progress()
        try:
            self._begin()
            self._learn()
        finally:
            self._shown.close()
            self.log.close()

    def _learn(self) -> None:
        try:
            self._algorithm.learn(self)
            self._update_clock()
            self._saved_at = -1  # some learn once more after their last step
            self._save()
            self._evaluate_at_the_end()
        except WorkbenchError:
            self._save_after_failure()
            raise

    def _make_progress(self) -> Progress:
        if self._run.total_timesteps:
            return Progress(self._run.total_timesteps, "step", self._algorithm.steps)
        return Progress(self._run.episodes, "episode", len(self._history.returns))

    def _begin(self) -> None:
        """Brings environment and generators to where they begin, or were."""
        run, algorithm = self._run, self._algorithm
        if not self._resumed:
            algorithm.start_environment(None, self._shown.say)
            about = f"training {self._options.kind.name} in {run.env_id} with seed {run.seed}"
            tell(f"{about}: {self.folder}")
            self._save()  # so that there is something to go on from, whatever happens
            return
        others = run_folder.other_versions(read_record(self.folder).get("versions"))
        if others:
            tell(f"{others}: from here on it may come to other bits")
        with fitting("state of the environment"):
            algorithm.start_environment(self._resumed["environment"], self._shown.say)
        restore_random_states(self._resumed["random"])
        if AT_THE_END in self._resumed and not self._is_complete():
            with fitting("score"):
                self._history.best = evaluation_of(self._resumed[AT_THE_END])
        tell(f"going on at step {algorithm.steps}{self._of_total()}: {self.folder}")
        self._resumed = None  # a replay buffer's worth of memory
        if algorithm.steps:
            self._evaluate_if_due()  # the interruption may have come before it

    def _of_total(self) -> str:
        run, done = self._run, len(self._history.returns)
        if run.total_timesteps:
            return f" of {run.total_timesteps}"
        return f" after episode {done} of {run.episodes}"

    # --- what an algorithm calls while it learns ------------------------------------------------

    def is_interrupted(self) -> bool:
        """Whether the user interrupts."""
        return self._interrupt.requested()

    def is_over(self) -> bool:
        """Whether it is complete, or the user interrupts."""
        return self._is_complete() or self._interrupt.requested()

    def _is_complete(self) -> bool:
        return self._history.is_complete(self._run, self._algorithm.steps)

    def episode_done(
        self,
        total_reward: float,
        length: int,
        scalars: Mapping[str, float],
        note: str = "",
        success: bool | None = None,
        step: int | None = None,
    ) -> None:
        """Takes an episode down, logs it, shows it; see `Frame.episode_done`."""
        history, steps = self._history, self._algorithm.steps
        history.returns.append(total_reward)
        history.lengths.append(length)
        if success is not None:
            history.successes.append(success)
        speed = (steps - self._first_step) / self._update_clock()
        charts = {
            RETURN: total_reward,
            "charts/episodic_length": float(length),
            "charts/SPS": speed,
        }
        if success is not None:
            charts[SUCCESS] = history.success_rate
        self.log.add(steps if step is None else step, {**charts, **scalars})
        told = [f"success: {history.success_rate:.0%}"] if history.successes else []
        note = ", ".join([*told, *([note] if note else [])])
        self._shown.episode_done(history.returns, length, f"{speed:.0f} steps/s", note)

    def step_done(self) -> None:
        """Does what is due at this step: an evaluation, a checkpoint."""
        self._shown.step_done(self._algorithm.steps)
        self._evaluate_if_due()
        if self._is_due(self._run.checkpoint_frequency):
            self._save()

    def _is_due(self, frequency: int) -> bool:
        """Whether a multiple of it lies within the last stride: episodes and vectors pass over some."""
        steps = self._algorithm.steps
        return (
            bool(frequency) and steps // frequency > (steps - self._algorithm.stride) // frequency
        )

    def _update_clock(self) -> float:
        """Brings the history's seconds up to now; returns those since the training was made."""
        elapsed = max(time.monotonic() - self._began, 1e-9)
        self._history.seconds = self._seconds_before + elapsed
        return elapsed

    # --- evaluations and checkpoints ------------------------------------------------------------

    def _evaluate_if_due(self) -> None:
        if self._history.was_evaluated(self._algorithm.steps):
            return
        is_due = self._is_due(self._run.eval_frequency)
        if is_due and self._evaluate(is_last=False):
            self._save(best=True)

    def _evaluate_at_the_end(self) -> None:
        """Evaluates the complete training, unless that was done at this step already.

        The last checkpoint's history doesn't know of it: a training that is prolonged goes on as if
        it had been longer from the beginning, but keeps this `best.pt` until there is a better one.
        """
        was_evaluated = self._history.was_evaluated(self._algorithm.steps)
        if not self._is_complete() or self._interrupt.requested() or was_evaluated:
            return
        content = self._content()
        if self._evaluate(is_last=True):
            content[AT_THE_END] = self._history.state_dict()["best"]
            self._checkpoints.save(self._algorithm.steps, content, best=True)

    def _evaluate(self, is_last: bool) -> bool:
        """Evaluates the policy and writes it down; returns whether it is the best one so far."""
        score = self._evaluator.evaluate(self._history.best_return, self._shown.say, is_last)
        if score is None:
            return False
        steps, history = self._algorithm.steps, self._history
        self._evaluation = score.evaluation
        mean = score.evaluation.mean_return
        rate = score.evaluation.success_rate
        self.log.add(steps, {EVALUATION: mean} | ({} if rate is None else {EVAL_SUCCESS: rate}))
        history.evaluations.append((steps, mean))
        if score.confirmed <= history.best_return:
            return False
        if self._run.confirm_episodes:
            self.log.add(steps, {CONFIRMED: score.confirmed})
        history.best = (steps, score.confirmed)
        return True

    def _save(self, best: bool = False) -> None:
        """Writes a checkpoint, unless this step has one already.

        Raises:
            OSError: if the disk refuses; the earlier checkpoints are untouched.
        """
        steps = self._algorithm.steps
        if steps != self._saved_at or best:
            self._checkpoints.save(steps, self._content(), best)
            self._saved_at = steps

    def _content(self) -> dict[str, Any]:
        return {
            **self._algorithm.state_dict(),
            "steps": self._algorithm.steps,
            "config": self._options.record(),
            "history": self._history.state_dict(),
            "environment": self._algorithm.environment_state(),
            "random": random_states(),
            "log_bytes": self.log.sync(),
        }

    def _save_after_failure(self) -> None:
        """What can't be written now is not what the user has to hear of."""
        with contextlib.suppress(OSError, WorkbenchError):
            if self._algorithm.settle():
                self._save()
            else:
                self._checkpoints.save_failure(self._content())

    # --- the end --------------------------------------------------------------------------------

    def _finish(self, failure: WorkbenchError | None) -> None:
        """Draws and tells; then passes a failure on, unless the user had stopped anyway."""
        outcome = TrainingOutcome(
            self._options, self.folder, self._history, self._algorithm.steps, self._is_complete(),
            self._interrupt.requested(), self._evaluation, self._checkpoints.are_in_place(),
        )  # fmt: skip
        try:
            self._checkpoints.check_place()
            self._algorithm.export(self.folder)
            outcome.write(str(failure) if failure else None)
        except (OSError, MemoryError) as error:
            problem = self._not_written(error)
            failure = problem if self._interrupt.requested() else failure or problem
        outcome.tell()
        # A simulator dies of the same Ctrl-C; what couldn't be written has to be told all the same.
        if failure and not (self._interrupt.requested() and self._is_written):
            left = outcome.what_is_left(self._is_written)
            place = write_traceback(self.folder, failure)
            raise WorkbenchError(f"{failure}{place}; {left}") from failure

    def _not_written(self, error: OSError | MemoryError) -> WorkbenchError:
        self._is_written = False
        if isinstance(error, MemoryError):
            return WorkbenchError("there is no memory left")
        return WorkbenchError(f"can't write {error.filename or self.folder}: {error.strerror}")
