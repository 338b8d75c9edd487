"""The training loop around an algorithm: open or resume, learn, evaluate, keep the best, save, report."""

import contextlib
import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import torch

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.states import random_states, restore_random_states, seed_all
from rl_workbench.storage import read_record
from rl_workbench.training import folder as run_folder
from rl_workbench.training.algorithm import Algorithm, check_device
from rl_workbench.training.callbacks import (
    Callback,
    CallbackList,
    CurvesPicture,
    EpisodeResult,
    EvaluationResult,
    ScalarLogger,
)
from rl_workbench.training.checkpoints import BEST, Checkpoints, candidates, fitting, read, read_newest
from rl_workbench.training.environments import close_all, robot_options, source_digest, training_environments
from rl_workbench.training.evaluator import Evaluation, Evaluator
from rl_workbench.training.history import History, Outcome, evaluation_of
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.progress import Progress, tell
from rl_workbench.training.scalar_log import ScalarLog

AT_THE_END = "best_at_the_end"  # in a checkpoint: its score after the training's end, if the best


class Training:
    """One training, new in an empty folder, or resumed from its own.

    Raises WorkbenchError if the environment can't be made or doesn't suit, or there is nothing to resume
    from.
    """

    log: ScalarLog

    def __init__(
        self, options: TrainingOptions, folder: Path, interrupt: Interrupt, callbacks: Sequence[Callback] = ()
    ) -> None:
        check_device(options.run.device)
        torch.set_num_threads(1)  # for networks this small more threads are slower
        self.options, self._run = options, options.run
        self.folder, self._interrupt = folder, interrupt
        self._checkpoints = Checkpoints(folder, self._run.keep_checkpoints)
        self.history, self._log_bytes = History(), 0
        self._resumed = self._read_checkpoint() if options.resume else None
        seed_all(self._run.seed)
        with contextlib.ExitStack() as making:
            self._envs = training_environments(options)
            making.callback(close_all, self._envs)
            make = import_module(options.kind.implementation).make
            self._algorithm: Algorithm = make(options, self._envs)
            self._evaluator = Evaluator(options, self._algorithm, self._envs[0], interrupt.requested, tell)
            making.callback(self._evaluator.close)
            self._rescored, self._task = None, source_digest(self._envs[0])
            if self._resumed:
                self._rescored = self._score_of_a_changed_task()
                self._load(self._resumed)
            making.pop_all()
        # [steps] of the last checkpoint; -1: there is none, or it is outdated.
        self._saved_at = self._algorithm.steps if self._resumed else -1
        self._is_written = True  # no write has failed so far
        self._evaluation: Evaluation | None = None  # the last one
        self._began, self._first_step = time.monotonic(), self._algorithm.steps
        self._seconds_before = self.history.seconds
        if self._run.total_timesteps:
            self._progress = Progress(self._run.total_timesteps, "step", self.steps)
        else:
            self._progress = Progress(self._run.episodes, "episode", len(self.history.returns))
        own = (ScalarLogger(), self._progress, CurvesPicture())
        self._callbacks = CallbackList(own, callbacks)

    @property
    def steps(self) -> int:
        """Steps of the environment so far."""
        return self._algorithm.steps

    @property
    def is_in_place(self) -> bool:
        """Whether the run folder is still where it was."""
        return self._checkpoints.are_in_place()

    def _read_checkpoint(self) -> dict[str, Any] | None:
        """Returns None if the training was killed before its first checkpoint: it starts from scratch."""
        if not candidates(self.folder):
            tell(f"{self.folder} has no checkpoint yet; starting from scratch")
            return None
        content = read_newest(self.folder, tell)
        self.options.check_same(content.get("config"), str(self.folder))
        return content

    def _load(self, content: dict[str, Any]) -> None:
        """Loads all but the environment's state, which needs a seeded environment."""
        self._algorithm.load_state_dict(content)
        with fitting("history"):
            self.history.load_state_dict(content["history"])
            self._log_bytes = int(content["log_bytes"])
        with fitting("state of the random generators"):
            restore_random_states(content["random"])

    def _score_of_a_changed_task(self) -> tuple[int, float] | None:
        """Returns step and new score of the best policy if the task's code has changed; else None."""
        before, path = read_record(self.folder).get("task"), self.folder / BEST
        if before in (None, self._task) or not path.exists():
            return None
        content = read(path)
        self._algorithm.load_state_dict(content)
        tell(f"the task's file has changed: {path.name} is evaluated again")
        score = self._evaluator.evaluate(-math.inf, tell, is_last=True)
        if score is None:  # interrupted: the next resumption evaluates it
            self._task = before
            return None
        return int(content["steps"]), score[1]

    # --- the course of a training ---------------------------------------------------------------

    def run(self) -> None:
        """Trains and writes everything. After a failure it saves the progress."""
        failure: WorkbenchError | None = None
        try:
            self._train()
        except WorkbenchError as error:
            failure = error
        except (OSError, MemoryError) as error:
            failure = self._not_written(error)
        finally:
            for close in (self._evaluator.close, partial(close_all, self._envs)):
                try:
                    close()
                except WorkbenchError as error:
                    failure = failure or error
        self._finish(failure)

    def _train(self) -> None:
        self._checkpoints.remove_leftovers()
        record = self.options.record()
        shared = robot_options(self._envs[0], self._run.training_environment)
        config = {**record, "shared_robot": shared, "task": self._task}
        run_folder.write_record(self.folder, config, bool(self._resumed))
        settings = {**record["run"], **record["hyperparameters"]}
        self.log = ScalarLog(self.folder, settings, self._log_bytes, tell)
        try:
            self._begin()
            self._learn()
        finally:
            self._progress.close()
            self.log.close()

    def _begin(self) -> None:
        """Starts or restores environment and generators."""
        run, algorithm = self._run, self._algorithm
        if not self._resumed:
            algorithm.start_environment(None, self._progress.say)
            about = f"training {self.options.kind.name} in {run.env_id} with seed {run.seed}"
            tell(f"{about}: {self.folder}")
            self._callbacks.call("on_training_start", self)
            self._save()  # so that a training can be resumed from its first moment
            return
        others = run_folder.other_versions(read_record(self.folder).get("versions"))
        if others:
            tell(f"{others}: the bits may differ from here on")
        with fitting("state of the environment"):
            algorithm.start_environment(self._resumed["environment"], self._progress.say)
        restore_random_states(self._resumed["random"])
        if AT_THE_END in self._resumed and not self._is_complete():
            with fitting("score"):
                self.history.best = evaluation_of(self._resumed[AT_THE_END])
        if self._rescored is not None:
            self.history.best, self._saved_at = self._rescored, -1
        total = f" after episode {len(self.history.returns)} of {run.episodes}"
        if run.total_timesteps:
            total = f" of {run.total_timesteps}"
        tell(f"resuming at step {algorithm.steps}{total}: {self.folder}")
        self._resumed = None  # it holds a replay buffer's worth of memory
        self._callbacks.call("on_training_start", self)
        self._save()  # unless nothing has changed
        if algorithm.steps:
            self._evaluate_if_due()  # the interruption may have come before it

    def _learn(self) -> None:
        try:
            self._algorithm.learn(self)
            self._update_clock()
            self._saved_at = -1  # some algorithms learn once more after their last step
            self._save()
            self._evaluate_at_the_end()
        except WorkbenchError:
            # The user needs to hear of this failure, not of one while saving.
            with contextlib.suppress(OSError, WorkbenchError):
                if self._algorithm.settle():
                    self._save()
            raise

    # --- called by algorithms ------------------------------------------------------------------

    def is_interrupted(self) -> bool:
        """Returns whether the user has interrupted."""
        return self._interrupt.requested()

    def is_over(self) -> bool:
        """Returns whether to stop: the training is complete, or the user interrupts."""
        return self._is_complete() or self._interrupt.requested()

    def _is_complete(self) -> bool:
        return self.history.is_complete(self._run, self._algorithm.steps)

    def episode_done(
        self,
        total_reward: float,
        length: int,
        scalars: Mapping[str, float],
        note: str = "",
        success: bool | None = None,
        step: int | None = None,
    ) -> None:
        """Records an episode and its undiscounted return.

        `scalars` are the algorithm's own figures; `note` stands in the line of every 20th episode, instead of
        the speed. It ended at `step`, or now; `success` is None if the environment doesn't say.
        """
        history, steps = self.history, self._algorithm.steps
        history.returns.append(total_reward)
        history.lengths.append(length)
        if success is not None:
            history.successes.append(success)
        speed = (steps - self._first_step) / self._update_clock()
        at = steps if step is None else step
        number = len(history.returns)
        episode = EpisodeResult(number, at, total_reward, length, success, speed, scalars, note)
        self._callbacks.call("on_episode", self, episode)

    def step_done(self) -> None:
        """Evaluates and saves if due; the training must be resumable at this point."""
        self._callbacks.call("on_step", self)
        self._evaluate_if_due()
        if self._is_due(self._run.checkpoint_frequency):
            self._save()

    def _is_due(self, frequency: int) -> bool:
        """Returns whether the last stride passed a multiple: episodes and vectors jump over some."""
        steps = self._algorithm.steps
        return bool(frequency) and steps // frequency > (steps - self._algorithm.stride) // frequency

    def _update_clock(self) -> float:
        """Updates the history's seconds; returns those since this object was made."""
        elapsed = max(time.monotonic() - self._began, 1e-9)
        self.history.seconds = self._seconds_before + elapsed
        return elapsed

    # --- evaluations and checkpoints ------------------------------------------------------------

    def _evaluate_if_due(self) -> None:
        is_new = not self.history.was_evaluated(self._algorithm.steps)
        if is_new and self._is_due(self._run.eval_frequency) and self._evaluate(is_last=False):
            self._save(best=True)

    def _evaluate_at_the_end(self) -> None:
        """Evaluates the complete training, unless that was done at this step already.

        The last checkpoint's history doesn't contain this evaluation. So a training that is prolonged
        continues as if it had been longer from the start, but keeps this `best.pt` until one is better.
        """
        was_evaluated = self.history.was_evaluated(self._algorithm.steps)
        if not self._is_complete() or self._interrupt.requested() or was_evaluated:
            return
        content = self._content()
        if self._evaluate(is_last=True):
            content[AT_THE_END] = self.history.state_dict()["best"]
            self._write_checkpoint(content, best=True)

    def _evaluate(self, is_last: bool) -> bool:
        """Evaluates the policy; returns whether it is the best one so far."""
        history, steps = self.history, self._algorithm.steps
        score = self._evaluator.evaluate(history.best_return, self._progress.say, is_last)
        if score is None:
            return False
        self._evaluation, confirmed = score
        history.evaluations.append((steps, self._evaluation.mean_return))
        is_best = confirmed > history.best_return
        if is_best:
            history.best = (steps, confirmed)
        was_confirmed = bool(self._run.confirm_episodes)
        result = EvaluationResult(steps, self._evaluation, confirmed, is_best, was_confirmed)
        self._callbacks.call("on_evaluation", self, result)
        return is_best

    def _save(self, best: bool = False) -> None:
        """Writes a checkpoint, unless this step has one already; raises OSError if it can't be written."""
        if self._algorithm.steps != self._saved_at or best:
            self._write_checkpoint(self._content(), best)

    def _write_checkpoint(self, content: dict[str, Any], best: bool) -> None:
        path = self._checkpoints.save(self._algorithm.steps, content, best)
        self._saved_at = self._algorithm.steps
        self._callbacks.call("on_checkpoint", self, path)

    def _content(self) -> dict[str, Any]:
        return {
            **self._algorithm.state_dict(),
            "steps": self._algorithm.steps,
            "config": self.options.record(),
            "history": self.history.state_dict(),
            "environment": self._algorithm.environment_state(),
            "random": random_states(),
            "log_bytes": self.log.sync(),
        }

    # --- the end --------------------------------------------------------------------------------

    def _finish(self, failure: WorkbenchError | None) -> None:
        """Writes and reports the outcome; then raises a failure, unless the user had stopped anyway."""
        outcome = Outcome(
            self.options, self.folder, self.history, self._algorithm.steps, self._is_complete(),
            self._interrupt.requested(), self._evaluation, self.is_in_place,
        )  # fmt: skip
        failure = self._tried(self._export, failure)
        failure = self._tried(partial(self._callbacks.call, "on_training_end", self), failure)
        if outcome.is_in_place:
            summary = partial(outcome.write_summary, str(failure) if failure else None)
            failure = self._tried(summary, failure)
        outcome.report()
        # After Ctrl-C the failure may be its effect, as it may have ended what the environment needs. A
        # failed write is reported all the same.
        if failure and not (self._interrupt.requested() and self._is_written):
            saved = self._saved_at if self._is_written else -1
            raise WorkbenchError(outcome.failure_text(failure, saved)) from failure

    def _export(self) -> None:
        self._checkpoints.check_place()
        self._algorithm.export(self.folder)

    def _tried(self, action: Callable[[], object], failure: WorkbenchError | None) -> WorkbenchError | None:
        """Returns the failure so far, or that of a final action."""
        try:
            action()
        except WorkbenchError as error:
            return failure or error
        except (OSError, MemoryError) as error:
            problem = self._not_written(error)
            return problem if self._interrupt.requested() else failure or problem
        return failure

    def _not_written(self, error: OSError | MemoryError) -> WorkbenchError:
        self._is_written = False
        if isinstance(error, MemoryError):
            return WorkbenchError("there is no memory left")
        return WorkbenchError(f"can't write {error.filename or self.folder}: {error.strerror}")
