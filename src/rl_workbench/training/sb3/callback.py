"""Stable-Baselines3's callback and logger that write the field's tags into our log."""

import math
import time
from collections.abc import Callable
from typing import Any

from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import KVWriter, Logger

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.run.history import History
from rl_workbench.training.run.scalar_log import ScalarLog
from rl_workbench.training.sb3.progress import SB3Progress

TAGS = {  # Stable-Baselines3's: ours
    "train/loss": "losses/loss",
    "train/value_loss": "losses/value_loss",
    "train/policy_loss": "losses/policy_loss",
    "train/policy_gradient_loss": "losses/policy_loss",
    "train/actor_loss": "losses/actor_loss",
    "train/critic_loss": "losses/critic_loss",
}


class _Writer(KVWriter):
    """Writes the losses that a model reports."""

    def __init__(self, log: ScalarLog) -> None:
        self._log = log

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, Any], step: int = 0
    ) -> None:
        found = {TAGS[key]: float(key_values[key]) for key in TAGS if key in key_values}
        for tag, value in found.items():
            check_finite(tag, value)
        self._log.add(step, found)

    def close(self) -> None:
        """The log is closed by who made it."""


def check_finite(name: str, value: float) -> None:
    """Ends a training whose figures are none, and which would only learn nonsense.

    Raises:
        WorkbenchError: if the value isn't a number, or infinite.
    """
    if not math.isfinite(value):
        raise WorkbenchError(f"{name} is {value}: a smaller learning_rate may help")


def logger_to(log: ScalarLog) -> Logger:
    """A logger for `model.set_logger`."""
    return Logger(None, [_Writer(log)])


class Follower(BaseCallback):
    """Writes each episode's figures, calls what is due, and stops when told to.

    Args:
        log: for the tags.
        history: is filled.
        progress: is told.
        due: functions, each with the steps between two calls of it; 0: never.
        should_stop: ends the training.
    """

    def __init__(
        self,
        log: ScalarLog,
        history: History,
        progress: SB3Progress,
        due: list[tuple[int, Callable[[], None]]],
        should_stop: Callable[[], bool],
    ) -> None:
        super().__init__()
        self._log, self._history, self._progress = log, history, progress
        self._due, self._should_stop = due, should_stop
        self._began, self._first_step, self._last_step = time.monotonic(), 0, 0

    def _on_training_start(self) -> None:
        self._began = time.monotonic()
        self._first_step = self._last_step = self.num_timesteps = self.model.num_timesteps

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                self._episode_done(float(info["episode"]["r"]), int(info["episode"]["l"]))
        self._progress.step_done(self.num_timesteps)
        # Several environments are stepped at once, so a multiple may be passed over.
        for every, call in self._due:
            if every and self.num_timesteps // every > self._last_step // every:
                call()
        self._last_step = self.num_timesteps
        return not self._should_stop()

    def _episode_done(self, total: float, length: int) -> None:
        check_finite(f"the return of episode {len(self._history.returns) + 1}", total)
        self._history.returns.append(total)
        self._history.lengths.append(length)
        elapsed = max(time.monotonic() - self._began, 1e-9)
        values = {
            "charts/episodic_return": total,
            "charts/episodic_length": float(length),
            "charts/SPS": (self.num_timesteps - self._first_step) / elapsed,
        }
        self._log.add(self.num_timesteps, values)
        self._progress.show(total, values["charts/SPS"])
