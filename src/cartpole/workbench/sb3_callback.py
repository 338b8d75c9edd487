"""Stable-Baselines3's callback and logger that write the field's tags into our log."""

import time
from collections.abc import Callable
from typing import Any

from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import KVWriter, Logger

from cartpole.training.progress import LINE_EVERY
from cartpole.training.scalar_log import ScalarLog
from cartpole.workbench.sb3_settings import SB3Run

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
        self._log.add(step, found)

    def close(self) -> None:
        """The log is closed by who made it."""


def logger_to(log: ScalarLog) -> Logger:
    """A logger for `model.set_logger`."""
    return Logger(None, [_Writer(log)])


class Follower(BaseCallback):
    """Writes each episode's figures, evaluates when that is due, and stops when told to.

    Args:
        log: for the tags.
        run: the settings.
        evaluate: is called with the log.
        should_stop: ends the training.
    """

    def __init__(
        self,
        log: ScalarLog,
        run: SB3Run,
        evaluate: Callable[[ScalarLog], None],
        should_stop: Callable[[], bool],
    ) -> None:
        super().__init__()
        self._log, self._run = log, run
        self._evaluate, self._should_stop = evaluate, should_stop
        self._began = time.monotonic()
        self._evaluated = 0  # [steps]
        self.returns: list[float] = []
        self.lengths: list[int] = []

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                self._episode_done(float(info["episode"]["r"]), int(info["episode"]["l"]))
        every = self._run.eval_frequency
        # Several environments are stepped at once, so a multiple may be passed over.
        if every and self.num_timesteps // every > self._evaluated // every:
            self._evaluated = self.num_timesteps
            self._evaluate(self._log)
        return not self._should_stop()

    def _episode_done(self, total: float, length: int) -> None:
        self.returns.append(total)
        self.lengths.append(length)
        speed = self.num_timesteps / max(time.monotonic() - self._began, 1e-9)
        values = {
            "charts/episodic_return": total,
            "charts/episodic_length": float(length),
            "charts/SPS": speed,
        }
        self._log.add(self.num_timesteps, values)
        if len(self.returns) % LINE_EVERY == 0:
            recent = self.returns[-LINE_EVERY:]
            print(
                f"Episode {len(self.returns):4d} | Reward: {total:8.2f} | "
                f"Avg({LINE_EVERY}): {sum(recent) / LINE_EVERY:8.2f} | {speed:.0f} steps/s",
                flush=True,
            )
