"""What Stable-Baselines3's loop tells the frame, and what the frame has it do."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import KVWriter

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.environments.answers import succeeded
from rl_workbench.training.run.algorithm import Frame

TAGS = {  # Stable-Baselines3's: ours
    "train/loss": "losses/loss",
    "train/value_loss": "losses/value_loss",
    "train/policy_loss": "losses/policy_loss",
    "train/policy_gradient_loss": "losses/policy_loss",
    "train/actor_loss": "losses/actor_loss",
    "train/critic_loss": "losses/critic_loss",
}


class LossWriter(KVWriter):
    """Writes the losses that a model reports."""

    def __init__(self, frame: Frame) -> None:
        self._frame = frame

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, Any], step: int = 0
    ) -> None:
        found = {TAGS[key]: float(key_values[key]) for key in TAGS if key in key_values}
        for tag, value in found.items():
            check_finite(tag, value)
        self._frame.log.add(step, found)

    def close(self) -> None:
        """The log is closed by who made it."""


class FrameCallback(BaseCallback):
    """Tells the frame of episodes and steps, and stops when it says so.

    Args:
        frame: of the training.
        total_timesteps: its length.
        was_given_up: whether an evaluation has moved the robot, whose episode can't be brought back.
    """

    def __init__(
        self, frame: Frame, total_timesteps: int, was_given_up: Callable[[], bool]
    ) -> None:
        super().__init__()
        self._frame, self._total, self._was_given_up = frame, total_timesteps, was_given_up
        self._episodes = 0
        self._held: int | None = None  # learning_starts, while hindsight has no whole episode

    def _on_training_start(self) -> None:
        model: Any = self.model  # off-policy, where it has a replay buffer
        self.num_timesteps = model.num_timesteps
        lengths = getattr(getattr(model, "replay_buffer", None), "ep_length", None)
        if lengths is not None and not lengths.any():
            self._held, model.learning_starts = model.learning_starts, math.inf

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                self._tell(*ended(info))
        self._frame.step_done()
        if self._was_given_up():
            self._begin_anew()
        if self.locals["dones"].any():
            self._release()
        # At its full length it ends by itself, and learns from the last rollout.
        return self.num_timesteps >= self._total or not self._frame.is_over()

    def _tell(self, total_reward: float, length: int, success: bool | None) -> None:
        self._episodes += 1
        check_finite(f"the return of episode {self._episodes}", total_reward)
        self._frame.episode_done(total_reward, length, {}, success=success)

    def _on_training_end(self) -> None:
        self._release()

    def _release(self) -> None:
        model: Any = self.model
        if self._held is not None:
            self._held, model.learning_starts = None, self._held

    def _begin_anew(self) -> None:
        """Cuts the episode off at this step, as at a time limit, and begins another one.

        The arrays are those that the loop goes on with. It is the first environment that was moved.
        """
        seen, dones, info = self.locals["new_obs"], self.locals["dones"], self.locals["infos"][0]
        if not dones[0]:
            dones[0], info["TimeLimit.truncated"] = True, True
            info["terminal_observation"] = _first(seen)
        envs: Any = self.training_env
        begun, _ = envs.envs[0].reset()
        parts = [(seen, begun)]
        if isinstance(seen, dict):
            parts = [(seen[name], begun[name]) for name in seen]
        for array, first in parts:
            array[0] = first


def _first(seen: Any) -> Any:
    """The first environment's observation, a copy."""
    if isinstance(seen, dict):
        return {name: np.array(part[0]) for name, part in seen.items()}
    return np.array(seen[0])


def ended(info: Mapping[str, Any]) -> tuple[float, int, bool | None]:
    """Return, length [steps] and success of an episode, from its last info, where Monitor put them."""
    return float(info["episode"]["r"]), int(info["episode"]["l"]), succeeded(info)


def check_finite(name: str, value: float) -> None:
    """Ends a training whose figures are none, and which would only learn nonsense.

    Raises:
        WorkbenchError: if the value isn't a number, or infinite.
    """
    if not math.isfinite(value):
        raise WorkbenchError(f"{name} is {value}: a smaller learning_rate may help")
