"""One DQN training: settings and a folder in; networks, figures and a summary out."""

import shlex
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from rl_workbench.curves import learning_curve
from rl_workbench.errors import WorkbenchError
from rl_workbench.figure import as_png
from rl_workbench.training.dqn.episode_tape import EpisodeTape
from rl_workbench.training.dqn.judge import Judge
from rl_workbench.training.dqn.loop import Loop, Observer
from rl_workbench.training.dqn.policy import make_agent
from rl_workbench.training.dqn.progress import DQNProgress
from rl_workbench.training.dqn.settings import Choice, check_same, config
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.checkpoints import Checkpoints, candidates, read_newest
from rl_workbench.training.run.environments import make_environment
from rl_workbench.training.run.files import as_json, write_atomically
from rl_workbench.training.run.history import History
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.random_states import random_states, restore_random_states, seed_all
from rl_workbench.training.run.record import read_record, write_record
from rl_workbench.training.run.scalar_log import Figures, ScalarLog

LAST = 100  # [episodes] over which the summary reports a mean


def say(text: str) -> None:
    """Tells the user, at once also when the output is a pipe."""
    print(text, flush=True)


class DQNTraining:
    """The training proper; new, or resumed from its folder.

    Args:
        choice: what the user chose.
        folder: an empty folder for all results, or the one of the resumed training.
        interrupt: tells when to stop.

    Raises:
        WorkbenchError: if the environment can't be made or doesn't suit, or there is nothing
            to resume from.
    """

    def __init__(self, choice: Choice, folder: Path, interrupt: Interrupt) -> None:
        torch.set_num_threads(1)  # networks this small only lose by more
        self._run, self._dqn = choice.run, choice.dqn
        self._folder, self._interrupt = folder, interrupt
        self._checkpoints = Checkpoints(folder, self._run.keep_checkpoints)
        self._resumed = self._read_checkpoint() if choice.resume else None
        seed_all(self._run.seed)
        self._env = make_environment(self._run.env_id, self._run.env_kwargs)
        try:
            self._agent = make_agent(self._run, self._dqn, self._env)
            self._judge = Judge(self._run, self._agent, self._env, interrupt.requested)
        except WorkbenchError:
            self._env.close()
            raise
        self._history = History()
        self._saved_at = -1  # [steps]
        self._is_written = True  # whatever was to be
        self._log: ScalarLog
        self._loop: Loop
        self._shown: DQNProgress

    def _read_checkpoint(self) -> dict[str, Any] | None:
        """None if the training was killed before its first checkpoint: it begins anew."""
        if not candidates(self._folder):
            say(f"{self._folder} has no checkpoint yet; beginning anew")
            return None
        content = read_newest(self._folder, say)
        check_same(self._run, self._dqn, content.get("config"), str(self._folder))
        self._checkpoints.remove_leftovers()
        return content

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
        finally:
            self._judge.close()
            self._env.close()
        self._finish(failure)

    def _train(self) -> None:
        tape = EpisodeTape(self._env, self._run.seed)
        self._restore_counters()
        self._log = self._open_log()
        self._shown = DQNProgress(self._dqn.total_timesteps, self._agent.steps, self._history)
        observers: list[Observer] = [Figures(self._log), self._shown]
        self._loop = Loop(tape, self._agent, self._history, observers, self._run.log_frequency)
        try:
            self._restore_episode()
            while not (self._is_complete() or self._interrupt.requested()):
                self._loop.step()
                self._follow_up()
            self._save()
        except WorkbenchError:
            self._checkpoints.save_failure(self._content())
            raise
        finally:
            self._shown.close()
            self._log.close()

    def _restore_counters(self) -> None:
        if self._resumed:
            self._agent.load_state_dict(self._resumed)
            self._history.load_state_dict(self._resumed["history"])

    def _open_log(self) -> ScalarLog:
        settings = {**asdict(self._run), **asdict(self._dqn)}
        length = self._resumed["log_bytes"] if self._resumed else 0
        return ScalarLog(self._folder, settings, length, say)

    def _restore_episode(self) -> None:
        write_record(self._folder, config(self._run, self._dqn), bool(self._resumed))
        if not self._resumed:
            say(f"training DQN in {self._run.env_id} with seed {self._run.seed}: {self._folder}")
            self._save()  # so that there is something to go on from, whatever happens
            return
        others = run_folder.other_versions(read_record(self._folder).get("versions", {}))
        if others:
            say(f"{others}: from here on it may come to other bits")
        self._loop.load_state_dict(self._resumed["loop"], self._shown.say)
        restore_random_states(self._resumed["random"])
        say(f"going on at step {self._agent.steps} of {self._dqn.total_timesteps}: {self._folder}")
        self._resumed = None  # a replay buffer's worth of memory
        if self._agent.steps:
            self._evaluate()  # the interruption may have come before it

    def _is_complete(self) -> bool:
        run, history = self._run, self._history
        return (
            self._agent.steps >= self._dqn.total_timesteps
            or bool(run.episodes and len(history.returns) >= run.episodes)
            or (run.stop_at_return is not None and self._best_return() >= run.stop_at_return)
        )

    def _best_return(self) -> float:
        return self._history.best[1] if self._history.best else float("-inf")

    def _follow_up(self) -> None:
        """What is due at this step: an evaluation, a checkpoint."""
        self._evaluate()
        every = self._run.checkpoint_frequency
        if every and self._agent.steps % every == 0:
            self._save()

    def _evaluate(self) -> None:
        """Evaluates the policy, if that is due and wasn't done at this step already."""
        steps, every = self._agent.steps, self._run.eval_frequency
        evaluations = self._history.evaluations
        if not every or steps % every or (evaluations and evaluations[-1][0] == steps):
            return
        verdict = self._judge.judge(self._loop, self._best_return(), self._shown.say)
        if verdict is None:
            return
        self._log.add(steps, {"eval/mean_reward": verdict.mean})
        evaluations.append((steps, verdict.mean))
        if verdict.confirmed > self._best_return():
            self._log.add(steps, {"eval/confirmed_reward": verdict.confirmed})
            self._history.best = (steps, verdict.confirmed)
            self._save(best=True)

    def _save(self, best: bool = False) -> None:
        """Writes a checkpoint, unless this step has one already."""
        steps = self._agent.steps
        if steps == self._saved_at:
            return
        self._checkpoints.save(steps, self._content(), best)
        self._saved_at = steps

    def _content(self) -> dict[str, Any]:
        self._loop.update_clock()
        return {
            **self._agent.state_dict(),
            "config": config(self._run, self._dqn),
            "history": self._history.state_dict(),
            "loop": self._loop.state_dict(),
            "random": random_states(),
            "log_bytes": self._log.sync(),
        }

    def _finish(self, failure: WorkbenchError | None) -> None:
        """Draws and tells; then passes a failure on, unless the user had stopped anyway."""
        try:
            self._draw()
            write_atomically(self._folder / "summary.json", as_json(self._summary(failure)))
        except OSError as error:
            problem = self._not_written(error)
            failure = problem if self._interrupt.requested() else failure or problem
        self._tell()
        # A simulator dies of the same Ctrl-C; what couldn't be written has to be told all the same.
        if failure and not (self._interrupt.requested() and self._is_written):
            text = (
                f"{failure}; stopped after {self._agent.steps} of {self._dqn.total_timesteps} steps"
            )
            if candidates(self._folder):
                text += (
                    f"; --resume {shlex.quote(str(self._folder))} goes on from the last checkpoint"
                )
            raise WorkbenchError(text)

    def _not_written(self, error: OSError) -> WorkbenchError:
        self._is_written = False
        return WorkbenchError(f"can't write {error.filename or self._folder}: {error.strerror}")

    def _draw(self) -> None:
        if self._history.returns:
            title = f"DQN, {self._run.env_id}, seed {self._run.seed}"
            path = self._folder / "learning_curve.png"
            write_atomically(
                path, as_png(learning_curve(self._history.lengths, self._history.returns, title))
            )

    def _summary(self, failure: WorkbenchError | None) -> dict[str, Any]:
        history = self._history
        return {
            **config(self._run, self._dqn),
            "versions": run_folder.versions(),
            "failure": str(failure) if failure else None,
            "complete": self._is_complete(),
            "interrupted": self._interrupt.requested(),
            "episodes": len(history.returns),
            "steps": self._agent.steps,
            "seconds": round(history.seconds, 3),
            f"mean_return_last_{LAST}": _mean(history.returns[-LAST:]),
            "best": history.best,
            "evaluations": history.evaluations,
            "lengths": history.lengths,
            "returns": history.returns,
        }

    def _tell(self) -> None:
        history = self._history
        line = f"trained {len(history.returns)} episodes, {self._agent.steps} steps in "
        line += f"{history.seconds:.1f} s"
        if history.best:
            line += f"; best evaluation {history.best[1]:.1f} at step {history.best[0]}"
        say(line)
        say(f"everything lies in {self._folder}")
        say(f"watch: tensorboard --logdir {shlex.quote(str(self._folder))}")


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None
