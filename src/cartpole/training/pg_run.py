"""One training by policy gradient: a plant and a folder in, networks, logs and a summary out."""

import shlex
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from cartpole.agents.policy_gradient import (
    GAMMA,
    POLICY_LEARNING_RATE,
    VALUE_LEARNING_RATE,
    PolicyGradientAgent,
)
from cartpole.agents.reinforce import ReinforceAgent, ReinforceSettings
from cartpole.envs.cartpole_env import CartPoleEnv
from cartpole.envs.plant import Plant
from cartpole.errors import CartpoleError
from cartpole.task import BalanceTask
from cartpole.training import run_folder
from cartpole.training.checkpoints import NetworkSaver
from cartpole.training.evaluation import Evaluation, evaluate
from cartpole.training.interrupt import Interrupt
from cartpole.training.logs import TensorBoardLog
from cartpole.training.loop import Agent, History, train
from cartpole.training.pg_settings import Settings
from cartpole.training.plots import learning_curve
from cartpole.training.progress import progress

SCALE = (0.4, 1.0, 0.2, 2.0)  # [m], [m/s], [rad], [rad/s]: what an observation comes to
LAST = 60  # [episodes] over which the summary reports a mean


def say(text: str) -> None:
    """Tells the user, at once also when the output is a pipe."""
    print(text, flush=True)


class Training:
    """The training proper: knows a plant, not where it comes from.

    Args:
        settings: what the user chose.
        folder: an empty folder for all results.
        plant: the robot.
        interrupt: tells when to stop.
    """

    def __init__(
        self, settings: Settings, folder: Path, plant: Plant, interrupt: Interrupt
    ) -> None:
        torch.set_num_threads(1)  # networks this small only lose by more
        self._settings = settings
        self._folder = folder
        self._plant = plant
        self._interrupt = interrupt
        self._agent = make_agent(settings)
        self._saver = NetworkSaver(folder, self._agent, settings.save_every)
        self._history = History()  # its clock starts here

    def run(self) -> None:
        """Trains and writes everything; what was learned is saved also when it fails.

        Raises:
            CartpoleError: if the simulator, the disk or the arithmetic fails.
        """
        failure: CartpoleError | None = None
        evaluation = None
        try:
            self._train()
            self._saver.save()
            evaluation = self._evaluate()
        except CartpoleError as error:
            failure = error
        except OSError as error:
            place = error.filename or self._folder
            failure = CartpoleError(f"can't write {place}: {error.strerror}")
        self._finish(evaluation, failure)

    def _train(self) -> None:
        settings = self._settings
        log = TensorBoardLog(self._folder, {**asdict(settings), **hyperparameters(settings)})
        shown = progress(settings.episodes)
        say(f"training for {settings.episodes} episodes with seed {settings.seed}")
        env = CartPoleEnv(self._plant, BalanceTask(noise=settings.start_noise))
        try:
            env.reset(seed=settings.seed)  # the loop's own resets go on from here
            train(
                env,
                self._agent,
                settings.episodes,
                self._history,
                [log, self._saver, shown],
                self._interrupt.requested,
                settings.stop_at or None,
            )
        finally:
            shown.close()
            log.close()

    def _evaluate(self) -> Evaluation | None:
        if self._interrupt.requested():
            return None
        return evaluate(
            self._plant, self._agent, self._settings.seed, should_stop=self._interrupt.requested
        )

    def _finish(self, evaluation: Evaluation | None, failure: CartpoleError | None) -> None:
        """Saves, draws, tells; then passes a failure on, unless the user had stopped anyway."""
        try:
            self._saver.save()
            self._draw()
            summary = self._summary(evaluation, failure)
            run_folder.write_summary(self._folder / "summary.json", summary)
        except OSError as error:
            failure = failure or CartpoleError(f"can't write to {self._folder}: {error.strerror}")
        self._tell(evaluation)
        if failure and not self._interrupt.requested():
            raise CartpoleError(
                f"{failure}; stopped after {len(self._history.episodes)} of "
                f"{self._settings.episodes} episodes, what was learned is saved in {self._folder}"
            )

    def _draw(self) -> None:
        if self._history.episodes:
            learning_curve(
                self._folder / "learning_curve.png",
                self._history.lengths,
                self._history.returns,
                f"policy gradient, seed {self._settings.seed}",
            )

    def _summary(
        self, evaluation: Evaluation | None, failure: CartpoleError | None
    ) -> dict[str, Any]:
        history = self._history
        return {
            "settings": asdict(self._settings),
            "hyperparameters": hyperparameters(self._settings),
            "versions": run_folder.versions(),
            "failure": str(failure) if failure else None,
            "interrupted": self._interrupt.requested(),
            "episodes": len(history.episodes),
            "steps": history.steps,
            "seconds": round(history.seconds, 3),
            f"mean_length_last_{LAST}": _mean(history.lengths[-LAST:]),
            "lengths": history.lengths,
            "returns": history.returns,
            "evaluation": asdict(evaluation) if evaluation else None,
        }

    def _tell(self, evaluation: Evaluation | None) -> None:
        history = self._history
        count = len(history.episodes)
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


def make_agent(settings: Settings) -> Agent:
    """The learner that the settings name."""
    if settings.algorithm == "gae":
        return ReinforceAgent(settings.seed, SCALE)
    return PolicyGradientAgent(settings.seed, settings.random_weights)


def hyperparameters(settings: Settings) -> dict[str, float]:
    """The algorithm's constants, for logs and summaries."""
    if settings.algorithm == "gae":
        return asdict(ReinforceSettings())
    return {
        "gamma": GAMMA,
        "policy_learning_rate": POLICY_LEARNING_RATE,
        "value_learning_rate": VALUE_LEARNING_RATE,
    }


def _mean(values: list[int]) -> float | None:
    return sum(values) / len(values) if values else None
