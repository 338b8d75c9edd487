"""`train`: one training with Stable-Baselines3, in a run folder like those of dqn_train.py."""

import contextlib
import shlex
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch

from rl_workbench.curves import learning_curve
from rl_workbench.errors import WorkbenchError
from rl_workbench.figure import as_png
from rl_workbench.training.dqn.run import LAST, say
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.checkpoints import LAST as RESUMABLE
from rl_workbench.training.run.checkpoints import Checkpoints, read_newest
from rl_workbench.training.run.environments import shares_robot
from rl_workbench.training.run.files import as_json, write_atomically, write_file
from rl_workbench.training.run.history import History
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.record import CONFIG_RECORD, read_record
from rl_workbench.training.run.scalar_log import ScalarLog
from rl_workbench.training.sb3.callback import Follower, logger_to
from rl_workbench.training.sb3.judge import SB3Judge
from rl_workbench.training.sb3.model import make_model
from rl_workbench.training.sb3.progress import SB3Progress
from rl_workbench.training.sb3.settings import SB3Choice, record, sb3_versions
from rl_workbench.training.sb3.state import check_weights, restore, state_of

# What the library raises in the midst of learning: weights or options that are no good.
_LEARNING = (ArithmeticError, AssertionError, LookupError, RuntimeError, TypeError, ValueError)
MODEL = "model.zip"  # Stable-Baselines3's own form, for its own load()


class SB3Training:
    """The training proper; new, or resumed from its folder.

    Args:
        choice: what the user chose.
        folder: an empty folder for all results, or the one of the resumed training.
        interrupt: tells when to stop.

    Raises:
        WorkbenchError: if the environment can't be made or doesn't suit, or there is nothing
            to resume from.
    """

    def __init__(self, choice: SB3Choice, folder: Path, interrupt: Interrupt) -> None:
        torch.set_num_threads(1)  # networks this small only lose by more
        self._choice, self._run = choice, choice.run
        self._folder, self._interrupt = folder, interrupt
        self._checkpoints = Checkpoints(folder, self._run.keep_checkpoints)
        self._history = History()
        self._resumed = read_newest(folder, say) if choice.resume else None
        self._model = make_model(choice)
        try:
            if self._resumed:
                restore(self._model, self._resumed, self._seed_from_here())
                self._history.load_state_dict(self._resumed["history"])
            self._judge = self._make_judge()
        except WorkbenchError:
            self._model.get_env().close()
            raise
        self._saved_at = -1  # [steps]
        self._is_written = True  # whatever was to be
        self._log: ScalarLog
        self._began = time.monotonic()

    def _seed_from_here(self) -> int:
        """Another one than at the start, or the same episodes would be explored again."""
        steps: int = self._resumed["counters"]["num_timesteps"] if self._resumed else 0
        return (self._run.seed + steps) % 2**31

    def _make_judge(self) -> SB3Judge | None:
        """None where nothing is evaluated: over ROS an evaluation would move the training's robot."""
        if shares_robot(self._model.get_env().envs[0]):
            if self._run.n_envs > 1:
                raise WorkbenchError(
                    f"over ROS there is one robot: n_envs is 1, not {self._run.n_envs}"
                )
            if self._run.eval_frequency:
                say("over ROS there is one robot: no evaluations during the training; the last "
                    "policy is kept, workbench.py eval tells what it is worth")  # fmt: skip
            return None
        return SB3Judge(self._run, self._model, self._interrupt.requested)

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
        except OSError as error:
            failure = self._not_written(error)
        except _LEARNING as error:
            failure = self._explained(error)
        finally:
            self._model.get_env().close()
            if self._judge:
                self._judge.close()
        self._finish(failure)

    def _explained(self, error: BaseException) -> WorkbenchError:
        try:
            check_weights(self._model)
        except WorkbenchError as reason:  # torch tells of it in its own words, if at all
            return reason
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        return WorkbenchError(f"{self._choice.algorithm} failed: {text}")

    def _train(self) -> None:
        self._checkpoints.remove_leftovers()
        self._record()
        self._tell_beginning()
        length = self._resumed["log_bytes"] if self._resumed else 0
        self._resumed = None  # a replay buffer's worth of memory
        settings = {**asdict(self._run), **self._choice.hyperparameters}
        self._log = ScalarLog(self._folder, settings, length)
        shown = SB3Progress(self._run.total_timesteps, self._steps, self._history)
        due = [(self._run.eval_frequency, self._evaluate),
               (self._run.checkpoint_frequency, self._save)]  # fmt: skip
        stop = self._interrupt.requested
        self._model.set_logger(logger_to(self._log))
        follower = Follower(self._log, self._history, shown, due, stop)
        remaining = max(self._run.total_timesteps - self._steps, 0)
        try:
            self._model.learn(remaining, callback=follower, reset_num_timesteps=False)
            self._save()
            write_file(self._folder / MODEL, self._model.save)
        except (WorkbenchError, *_LEARNING):
            with contextlib.suppress(WorkbenchError, OSError):  # these may well be the failure
                self._checkpoints.save_failure(self._content())
            raise
        finally:
            shown.close()
            self._log.close()

    def _record(self) -> None:
        """Writes config.json; of a resumed training, whose length may be new, the rest stays."""
        content = {"versions": sb3_versions(), "began": time.time()}
        if self._resumed:
            content = read_record(self._folder)
        write_atomically(self._folder / CONFIG_RECORD, as_json(content | record(self._choice)))

    def _tell_beginning(self) -> None:
        if self._resumed:
            say(f"going on at step {self._steps} of {self._run.total_timesteps}, with a new episode "
                f"and other random numbers: {self._folder}")  # fmt: skip
            return
        say(f"training {self._choice.algorithm} in {self._run.env_id} with seed {self._run.seed}: "
            f"{self._folder}")  # fmt: skip

    @property
    def _steps(self) -> int:
        return int(self._model.num_timesteps)

    def _evaluate(self) -> None:
        """Saves the policy if it is the best one so far."""
        history = self._history
        best = history.best[1] if history.best else float("-inf")
        verdict = self._judge.judge(best) if self._judge else None
        if verdict is None:
            return
        self._log.add(self._steps, {"eval/mean_reward": verdict.mean})
        history.evaluations.append((self._steps, verdict.mean))
        if verdict.confirmed > best:
            self._log.add(self._steps, {"eval/confirmed_reward": verdict.confirmed})
            history.best = (self._steps, verdict.confirmed)
        self._save(verdict.confirmed > best)

    def _save(self, best: bool = False) -> None:
        """Writes a checkpoint, unless this step has one already."""
        if self._steps != self._saved_at:
            self._checkpoints.save(self._steps, self._content(), best)
            self._saved_at = self._steps

    def _content(self) -> dict[str, Any]:
        history = replace(self._history, seconds=self._seconds)
        return {
            **state_of(self._model),
            "steps": self._steps,
            "config": record(self._choice),
            "history": history.state_dict(),
            "log_bytes": self._log.sync(),
        }

    @property
    def _seconds(self) -> float:
        """Wall time of the whole training, without the pauses before it was resumed."""
        return self._history.seconds + time.monotonic() - self._began

    def _finish(self, failure: WorkbenchError | None) -> None:
        history = self._history
        try:
            if history.returns:
                title = f"{self._choice.algorithm}, {self._run.env_id}, seed {self._run.seed}"
                path = self._folder / "learning_curve.png"
                write_atomically(
                    path, as_png(learning_curve(history.lengths, history.returns, title))
                )
            write_atomically(self._folder / "summary.json", as_json(self._summary(failure)))
        except OSError as error:
            problem = self._not_written(error)
            failure = problem if self._interrupt.requested() else failure or problem
        self._tell()
        if failure and not (self._interrupt.requested() and self._is_written):
            raise WorkbenchError(
                f"{failure}; stopped after {self._steps} steps{self._how_to_go_on}"
            )

    def _not_written(self, error: OSError) -> WorkbenchError:
        self._is_written = False
        return WorkbenchError(f"can't write {error.filename or self._folder}: {error.strerror}")

    @property
    def _how_to_go_on(self) -> str:
        if not (self._folder / RESUMABLE).exists():
            return ""
        return f"; train --resume {shlex.quote(str(self._folder))} goes on from the last checkpoint"

    def _is_complete(self) -> bool:
        return self._steps >= self._run.total_timesteps

    def _summary(self, failure: WorkbenchError | None) -> dict[str, Any]:
        history = self._history
        recent = history.returns[-LAST:]
        return {
            **record(self._choice),
            "versions": sb3_versions(),
            "failure": str(failure) if failure else None,
            "complete": self._is_complete(),
            "interrupted": self._interrupt.requested(),
            "episodes": len(history.returns),
            "steps": self._steps,
            "seconds": round(self._seconds, 3),
            f"mean_return_last_{LAST}": sum(recent) / len(recent) if recent else None,
            "best": history.best,
            "evaluations": history.evaluations,
            "lengths": history.lengths,
            "returns": history.returns,
        }

    def _tell(self) -> None:
        line = f"trained {len(self._history.returns)} episodes, {self._steps} steps in "
        line += f"{self._seconds:.1f} s"
        if self._history.best:
            line += "; best evaluation {1:.1f} at step {0}".format(*self._history.best)
        say(line)
        stopped = self._interrupt.requested()
        say(f"everything lies in {self._folder}{self._how_to_go_on if stopped else ''}")


def train(choice: SB3Choice, interrupt: Interrupt) -> Path:
    """Trains into the choice's folder, or a new one below runs/; returns it.

    Raises:
        WorkbenchError: if something fails that the user can mend; what was learned is saved.
    """
    run = choice.run
    folder = choice.resume or run_folder.create(
        run.run_dir or None, run.env_id, run.exp_name, run.seed
    )
    try:
        with run_folder.held(folder):
            training = SB3Training(choice, folder.resolve(), interrupt)
            interrupt.defer()
            training.run()
    finally:
        interrupt.defer()
        run_folder.remove_if_empty(folder)
    return folder
