"""What Stable-Baselines3's loop tells the frame, and what the frame has it do."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.environments.answers import succeeded
from rl_workbench.training.run.algorithm import Frame
from rl_workbench.training.sb3.positions import Mark, Positions
from rl_workbench.training.sb3.state import LOSSES, losses_of


class Ended(NamedTuple):
    """An episode that ended within a rollout."""

    step: int
    total_reward: float
    length: int  # [steps]
    success: bool | None  # None if the environment doesn't say


class FrameCallback(BaseCallback):
    """Between two rollouts it has the frame evaluate and save, and stops when that says so.

    On-policy, an interrupt breaks off a rollout, and what was played of it is taken back: its episodes are
    told when it is whole. Off-policy, rollouts are short, and change what was learned: they go to their end.

    Args:
        frame: of the training.
        positions: of its model; None where workers have the environments.
        log_frequency: steps between two points of losses.
    """

    def __init__(self, frame: Frame, positions: Positions | None, log_frequency: int) -> None:
        super().__init__()
        self._frame, self._positions, self._log_frequency = frame, positions, log_frequency
        self._ended: list[Ended] = []  # not told yet
        self._episodes = 0
        self._held: int | None = None  # learning_starts, while hindsight has no whole episode
        self._mark: Mark | None = None
        self._can_go_back = False  # nothing has changed since that can't be taken back

    def _on_training_start(self) -> None:
        model: Any = self.model  # off-policy, where it has a replay buffer
        self._arrived, self._is_on_policy = (
            model.num_timesteps,
            isinstance(model, OnPolicyAlgorithm),
        )
        lengths = getattr(getattr(model, "replay_buffer", None), "ep_length", None)
        if lengths is not None and not lengths.any():
            self._held, model.learning_starts = model.learning_starts, math.inf

    def goes_on(self) -> bool:
        """Between two rollouts: whether there is to be another one."""
        if self.model.num_timesteps > self._arrived:
            self._arrive()
        self._stand()
        return not self._frame.is_over()

    def _arrive(self) -> None:
        model: Any = self.model
        model.stride = model.num_timesteps - self._arrived
        self._arrived = model.num_timesteps
        self._log_losses(model)
        self._stand()
        self._frame.step_done()

    def _stand(self) -> None:
        self._can_go_back = True
        if self._positions is not None:
            self._mark = self._positions.mark()

    def go_back(self) -> bool:
        """Takes back what was done since the last rollout, to be saved; returns whether it could."""
        if self._can_go_back and self._mark is not None and self._positions is not None:
            self._positions.take_back(self._mark)
        return self._can_go_back

    def _log_losses(self, model: Any) -> None:
        found = {LOSSES[name]: value for name, value in losses_of(model).items()}
        for tag, value in found.items():
            check_finite(tag, value)
        steps, frequency = self._arrived, self._log_frequency
        if found and steps // frequency > (steps - model.stride) // frequency:
            self._frame.log.add(steps, found)
            model.logger.dump(steps)  # nowhere: it forgets them

    def _on_step(self) -> bool:
        steps = self.model.num_timesteps
        for info in self.locals["infos"]:
            if "episode" in info:
                self._ended.append(ended(info, steps))
        if self._is_on_policy:
            return not self._frame.is_interrupted()
        self._can_go_back = False
        self._tell()
        if self.locals["dones"].any():
            self._release()
        return True

    def _on_rollout_end(self) -> None:
        self._can_go_back = False
        self._tell()

    def _tell(self) -> None:
        """Tells the frame of episodes, each with the step of its end."""
        for episode in self._ended:
            self._episodes += 1
            check_finite(f"the return of episode {self._episodes}", episode.total_reward)
            step, total_reward, length, success = episode
            self._frame.episode_done(total_reward, length, {}, success=success, step=step)
        self._ended = []

    def _on_training_end(self) -> None:
        self._release()
        if not self.go_back() and self.model.num_timesteps > self._arrived:
            self._arrive()

    def _release(self) -> None:
        model: Any = self.model
        if self._held is not None:
            self._held, model.learning_starts = None, self._held


def ended(info: Mapping[str, Any], step: int) -> Ended:
    """An episode, from its last info, where Monitor put its figures."""
    episode = info["episode"]
    return Ended(step, float(episode["r"]), int(episode["l"]), succeeded(info))


def check_finite(name: str, value: float) -> None:
    """Ends a training whose figures are none, and which would only learn nonsense.

    Raises:
        WorkbenchError: if the value isn't a number, or infinite.
    """
    if not math.isfinite(value):
        raise WorkbenchError(f"{name} is {value}: a smaller learning_rate may help")
