"""Callbacks for the events of a training, among them the scalar log and the learning curve's picture."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from rl_workbench.errors import EnvironmentFailure, WorkbenchError, error_line
from rl_workbench.option import imported
from rl_workbench.storage import write_atomically
from rl_workbench.training.scalar_log import CONFIRMED, EVAL_SUCCESS, EVALUATION, RETURN, SUCCESS

if TYPE_CHECKING:
    from pathlib import Path


class EpisodeResult(NamedTuple):
    """An episode that has ended."""

    number: int  # from 1 on
    step: int  # of the training, at its end
    total_reward: float  # undiscounted
    length: int  # [steps]
    success: bool | None  # None if the environment doesn't say
    speed: float  # of the training [steps/s]
    scalars: Mapping[str, float]  # the algorithm's own figures
    note: str  # the algorithm's own remark, for the progress line


class EvaluationResult(NamedTuple):
    """An evaluation by greedy episodes."""

    step: int  # of the training
    evaluation: Any  # an evaluator.Evaluation: lengths, returns and successes of its episodes
    confirmed: float  # the mean return by which policies are compared
    is_best: bool  # better than any policy before
    was_confirmed: bool  # `confirmed` is over more episodes than the evaluation's


class Callback:
    """Base class of callbacks: override the events that you need.

    Pass instances to `rl_workbench.train(..., callbacks=[...])`, or name a class that needs no arguments
    with `--callback module:Class`, several with commas:

        from rl_workbench import Callback

        class Printer(Callback):
            def on_episode(self, training, episode):
                print(episode.number, episode.total_reward)

    Every event gets the training. It has `options` (`options.run`, `options.hyperparameters`,
    `options.record()` as plain values), `folder` (the run folder), `steps`, `history` (returns, lengths and
    evaluations so far), and `log.add(step, {tag: value})`, which writes to scalars.csv and TensorBoard.

    Callbacks run in the order of the list, after our own. They must not touch the random generators of
    Python, NumPy or torch, or the training ends with other weights. A callback that raises ends the
    training with one line, which names the step up to which progress is saved.
    """

    def on_training_start(self, training: Any) -> None:
        """Called once the environments are made; a resumed training has loaded its checkpoint."""

    def on_step(self, training: Any) -> None:
        """Called after the algorithm has learned from a step, a rollout or an episode."""

    def on_episode(self, training: Any, episode: EpisodeResult) -> None:
        """Called at the end of an episode."""

    def on_evaluation(self, training: Any, result: EvaluationResult) -> None:
        """Called after an evaluation."""

    def on_checkpoint(self, training: Any, path: "Path") -> None:
        """Called after a checkpoint was written."""

    def on_training_end(self, training: Any) -> None:
        """Called at the end, when everything is saved, also of an interrupted or failed training."""


class ScalarLogger(Callback):
    """Logs episodes and evaluations."""

    def on_episode(self, training: Any, episode: EpisodeResult) -> None:
        charts = {
            RETURN: episode.total_reward,
            "charts/episodic_length": float(episode.length),
            "charts/SPS": episode.speed,
        }
        if episode.success is not None:
            charts[SUCCESS] = training.history.success_rate
        training.log.add(episode.step, {**charts, **episode.scalars})

    def on_evaluation(self, training: Any, result: EvaluationResult) -> None:
        figures = {EVALUATION: result.evaluation.mean_return}
        if result.evaluation.success_rate is not None:
            figures[EVAL_SUCCESS] = result.evaluation.success_rate
        if result.is_best and result.was_confirmed:
            figures[CONFIRMED] = result.confirmed
        training.log.add(result.step, figures)


class CurvesPicture(Callback):
    """Draws learning_curve.png at the end."""

    def on_training_end(self, training: Any) -> None:
        history, run = training.history, training.options.run
        if not history.returns or not training.is_in_place:
            return
        # matplotlib is slow to import
        from rl_workbench.plotting import as_png, learning_curve

        title = f"{training.options.kind.name}, {run.env_id}, seed {run.seed}"
        figure = learning_curve(history.lengths, history.returns, title, history.successes)
        write_atomically(training.folder / "learning_curve.png", as_png(figure))


def load_callbacks(names: str) -> list[Callback]:
    """Makes callbacks of the user's own: module:Class, several with commas."""
    callbacks = []
    for name in filter(None, map(str.strip, names.split(","))):
        make = imported(name, "--callback")
        try:
            made = make()
        except Exception as error:
            raise WorkbenchError(f"--callback {name}: {error_line(error)}") from error
        if not isinstance(made, Callback):
            text = "it must be a subclass of rl_workbench.Callback"
            raise WorkbenchError(f"--callback {name}: {text}")
        callbacks.append(made)
    return callbacks


class CallbackList:
    """Calls the callbacks of a training. Errors of the user's end it with one line, ours propagate."""

    def __init__(self, own: Sequence[Callback], users: Sequence[Callback]) -> None:
        self._own, self._users = own, users

    def call(self, event: str, training: Any, *arguments: Any) -> None:
        """Calls the method of an event."""
        for own in self._own:
            getattr(own, event)(training, *arguments)
        for user in self._users:
            try:
                getattr(user, event)(training, *arguments)
            except Exception as error:
                name = type(user).__name__
                text = f"the callback {name} failed in {event}(): {error_line(error)}"
                raise EnvironmentFailure(text) from error
