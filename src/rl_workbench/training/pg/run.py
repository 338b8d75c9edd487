"""One training by policy gradient: a stage and a folder in; networks, figures and a summary out."""

import contextlib
import shlex
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from rl_workbench.curves import learning_curve
from rl_workbench.errors import WorkbenchError
from rl_workbench.figure import as_png
from rl_workbench.training.pg.figures import PolicyFigures
from rl_workbench.training.pg.keeper import Keeper
from rl_workbench.training.pg.loop import Observer, is_complete, train
from rl_workbench.training.pg.policy import hyperparameters, make_agent, restore
from rl_workbench.training.pg.settings import Choice, check_same, config
from rl_workbench.training.pg.stage import Stage
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.checkpoints import candidates, read_newest
from rl_workbench.training.run.evaluation import Evaluation
from rl_workbench.training.run.files import NetworkSaver, as_json, write_atomically
from rl_workbench.training.run.history import History
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.progress import progress
from rl_workbench.training.run.random_states import seed_all
from rl_workbench.training.run.record import read_record, write_record
from rl_workbench.training.run.scalar_log import ScalarLog

LAST = 60  # [episodes] over which the summary reports a mean


def say(text: str) -> None:
    """Tells the user, at once also when the output is a pipe."""
    print(text, flush=True)


class Training:
    """The training proper; new, or resumed from its folder.

    Args:
        choice: what the user chose.
        folder: an empty folder for all results, or the one of the resumed training.
        stage: where it takes place.
        interrupt: tells when to stop.

    Raises:
        WorkbenchError: if the environment doesn't suit the algorithm, or there is nothing to
            resume from.
    """

    def __init__(self, choice: Choice, folder: Path, stage: Stage, interrupt: Interrupt) -> None:
        torch.set_num_threads(1)  # networks this small only lose by more
        self._choice, self._run = choice, choice.run
        self._folder, self._stage, self._interrupt = folder, stage, interrupt
        self._hyperparameters = hyperparameters(choice)
        seed_all(self._run.seed)
        self._agent = make_agent(choice, stage.env)
        self._history = History()
        self._resumed = self._read_checkpoint() if choice.resume else None
        self._saver = NetworkSaver(folder, self._agent, self._run.save_every)
        self._evaluation: Evaluation | None = None
        self._is_written = True  # whatever was to be

    def _read_checkpoint(self) -> dict[str, Any] | None:
        """Takes over agent and history at once: whatever fails from here on writes these down again.

        None if the training was killed before its first checkpoint: it begins anew.
        """
        if not candidates(self._folder):
            say(f"{self._folder} has no checkpoint yet; beginning anew")
            return None
        content = read_newest(self._folder, say)
        check_same(self._choice, content.get("config"), str(self._folder))
        restore(self._agent, content, str(self._folder))
        self._history.load_state_dict(content["history"])
        return content

    def run(self) -> None:
        """Trains and writes everything; what was learned is saved also when it fails.

        Raises:
            WorkbenchError: if the simulator, the disk or the arithmetic fails.
        """
        failure: WorkbenchError | None = None
        try:
            self._train()
        except WorkbenchError as error:
            failure = error
        except OSError as error:
            failure = self._not_written(error)
        self._finish(failure)

    def _not_written(self, error: OSError) -> WorkbenchError:
        self._is_written = False
        return WorkbenchError(f"can't write {error.filename or self._folder}: {error.strerror}")

    def _train(self) -> None:
        record = config(self._choice, self._hyperparameters)
        write_record(self._folder, record, bool(self._resumed))
        self._stage.env.reset(seed=self._run.seed)  # the loop's own resets go on from here
        length = self._resumed["log_bytes"] if self._resumed else 0
        log = ScalarLog(self._folder, {**asdict(self._run), **self._hyperparameters}, length, say)
        try:
            keeper = Keeper(self._choice, self._folder, self._stage, self._agent, self._history,
                            log, self._interrupt.requested)  # fmt: skip
            if self._resumed:
                keeper.go_on(self._resumed)
            self._begin(keeper)
            self._learn(keeper, log)
            self._saver.save()
            self._evaluation = keeper.finish()
        finally:
            log.close()

    def _begin(self, keeper: Keeper) -> None:
        run, done = self._run, len(self._history.lengths)
        if self._resumed:
            others = run_folder.other_versions(read_record(self._folder).get("versions", {}))
            if others:
                say(f"{others}: from here on it may come to other bits")
            say(f"going on after episode {done} of {run.episodes}: {self._folder}")
            return
        where = "" if run.is_robot else f" in {run.env_id}"
        say(f"training{where} for {run.episodes} episodes with seed {run.seed}")
        keeper.save()  # so that there is something to go on from, whatever happens

    def _learn(self, keeper: Keeper, log: ScalarLog) -> None:
        """The loop; whatever ends it, the training stands at the end of an episode then."""
        run = self._run
        shown = progress(run.episodes, done=len(self._history.lengths))
        observers: list[Observer] = [PolicyFigures(log), self._saver, shown, keeper]
        try:
            if self._resumed:
                keeper.evaluate_if_due()  # the interruption may have come before it
            train(
                self._stage.env,
                self._agent,
                run.episodes,
                self._history,
                observers,
                self._interrupt.requested,
                run.stop_at,
            )
            keeper.rewind()
        except WorkbenchError:
            keeper.rewind()
            with contextlib.suppress(OSError):  # the failure is what the user has to hear of
                keeper.save()
            raise
        finally:
            shown.close()

    def _is_complete(self) -> bool:
        return is_complete(self._history, self._run.episodes, self._run.stop_at)

    def _finish(self, failure: WorkbenchError | None) -> None:
        """Saves, draws, tells; then passes a failure on, unless the user had stopped anyway."""
        try:
            self._saver.save()
            self._draw()
            write_atomically(self._folder / "summary.json", as_json(self._summary(failure)))
        except OSError as error:
            problem = self._not_written(error)
            failure = problem if self._interrupt.requested() else failure or problem
        self._tell()
        # A simulator dies of the same Ctrl-C; what couldn't be written has to be told all the same.
        if failure and not (self._interrupt.requested() and self._is_written):
            raise WorkbenchError(f"{failure}; {self._what_is_left()}")

    def _what_is_left(self) -> str:
        text = f"stopped after {len(self._history.lengths)} of {self._run.episodes} episodes"
        if self._is_written:
            text += f", what was learned is saved in {self._folder}"
        if candidates(self._folder):
            text += f"; --resume {shlex.quote(str(self._folder))} goes on from the last checkpoint"
        return text

    def _draw(self) -> None:
        if self._history.lengths:
            what = "policy gradient" if self._run.is_robot else f"REINFORCE, {self._run.env_id}"
            title = f"{what}, seed {self._run.seed}"
            figure = learning_curve(self._history.lengths, self._history.returns, title)
            write_atomically(self._folder / "learning_curve.png", as_png(figure))

    def _summary(self, failure: WorkbenchError | None) -> dict[str, Any]:
        history = self._history
        return {
            **config(self._choice, self._hyperparameters),
            "versions": run_folder.versions(),
            "failure": str(failure) if failure else None,
            "complete": self._is_complete(),
            "interrupted": self._interrupt.requested(),
            "episodes": len(history.lengths),
            "steps": history.steps,
            "seconds": round(history.seconds, 3),
            f"mean_length_last_{LAST}": _mean(history.lengths[-LAST:]),
            "best": history.best,
            "evaluations": history.evaluations,
            "lengths": history.lengths,
            "returns": history.returns,
            "evaluation": asdict(self._evaluation) if self._evaluation else None,
        }

    def _tell(self) -> None:
        history, evaluation = self._history, self._evaluation
        count = len(history.lengths)
        mean = _mean(history.lengths[-LAST:])
        line = f"trained {count} episodes, {history.steps} steps in {history.seconds:.1f} s"
        if mean is not None:
            line += f"; mean length of the last {min(count, LAST)}: {mean:.1f}"
        if evaluation:
            line += (
                f"; greedy over {len(evaluation.lengths)}: length {evaluation.mean_length:.1f}, "
                f"return {evaluation.mean_return:.1f}"
            )
        say(line)
        say(f"everything lies in {self._folder}")
        say(f"watch: tensorboard --logdir {shlex.quote(str(self._folder))}")


def _mean(values: list[int]) -> float | None:
    return sum(values) / len(values) if values else None
