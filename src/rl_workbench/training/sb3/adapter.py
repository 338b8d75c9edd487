"""Stable-Baselines3 as an algorithm of the training loop: its own loop, with a callback for ours."""

import math
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from rl_workbench.errors import WorkbenchError
from rl_workbench.states import check_optimizer
from rl_workbench.storage import write_atomically
from rl_workbench.training.algorithm import Algorithm, Say, check_finite
from rl_workbench.training.checked import CURVES
from rl_workbench.training.checkpoints import fitting
from rl_workbench.training.environments import succeeded
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.sb3.demonstrated import fill
from rl_workbench.training.sb3.models import load_policy, make_learning_model
from rl_workbench.training.sb3.positions import ModelMark, Positions, buffer_state, restore_buffer
from rl_workbench.training.training import Training

__all__ = ["load_policy", "make"]

# What the library raises while it learns, for unusable weights or options.
_LEARNING = (ArithmeticError, AssertionError, LookupError, RuntimeError, TypeError, ValueError)
MODEL = "model.zip"  # for Stable-Baselines3's own load()
COUNTERS = ("num_timesteps", "_episode_num", "_n_updates", "_n_calls", "stride")
ENTROPY = "log_ent_coef"  # SAC's, not part of a network
LOSSES = {  # Stable-Baselines3's names: our tags
    "train/loss": "losses/loss",
    "train/value_loss": "losses/value_loss",
    "train/policy_loss": "losses/policy_loss",
    "train/policy_gradient_loss": "losses/policy_loss",
    "train/actor_loss": "losses/actor_loss",
    "train/critic_loss": "losses/critic_loss",
}


def make(options: TrainingOptions, envs: list[Any]) -> "SB3Training":
    """Makes a new training; see `algorithm`."""
    if not options.run.total_timesteps:
        raise WorkbenchError(f"{options.kind.name} needs total_timesteps: its schedules depend on them")
    return SB3Training(options, make_learning_model(options, envs))


class SB3Training(Algorithm):
    """A model of Stable-Baselines3, evaluated and saved between two rollouts."""

    def __init__(self, options: TrainingOptions, model: Any) -> None:
        self._run, self._name, self._model = options.run, options.kind.name, model
        self._demos = str(getattr(options.hyperparameters, "demos", ""))
        self._positions = Positions(model)
        self._callback: FrameCallback | None = None

    @property
    def steps(self) -> int:
        return int(self._model.num_timesteps)

    @property
    def stride(self) -> int:
        return int(self._model.stride)

    def act_greedily(self, observation: np.ndarray) -> Any:
        return self._model.policy.predict(observation, deterministic=True)[0]

    def learn(self, frame: Training) -> None:
        remaining = max(self._run.total_timesteps - self.steps, 0)
        self._callback = FrameCallback(frame, self._positions, self._run.log_frequency)
        try:
            # The callback logs losses between two rollouts, so the library doesn't.
            self._model.learn(
                remaining, callback=self._callback, log_interval=None, reset_num_timesteps=False
            )
        except WorkbenchError:
            raise
        except _LEARNING as error:
            self.check_weights()  # raises a clearer error than torch's text about NaN
            text = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise WorkbenchError(f"{self._name} failed: {text}") from error

    def settle(self) -> bool:
        """Takes back the steps since the last rollout. A half-finished update can't be taken back."""
        return self._callback is not None and self._callback.go_back()

    def check_weights(self) -> None:
        check_finite(self._model.policy.parameters())

    def state_dict(self) -> dict[str, Any]:
        self.check_weights()
        model = self._model
        parameters = model.get_parameters()
        policy = parameters.pop("policy")
        entropy = getattr(model, ENTROPY, None)
        return {
            "policy": policy,
            "optimizers": parameters,
            "entropy": None if entropy is None else entropy.detach(),
            "counters": {name: getattr(model, name) for name in COUNTERS if hasattr(model, name)},
            "losses": _pending_losses(model),
            "buffer": buffer_state(getattr(model, "replay_buffer", None)),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        model = self._model
        with fitting("model"):
            for name, optimizer in state["optimizers"].items():
                check_optimizer(attrgetter(name)(model), optimizer)
            model.set_parameters({"policy": state["policy"], **state["optimizers"]})
            if state["entropy"] is not None:
                getattr(model, ENTROPY).data.copy_(state["entropy"])
            if state["counters"]["num_timesteps"] != state["steps"]:
                raise ValueError(f"{state['counters']['num_timesteps']} steps of {state['steps']}")
            for name, value in state["counters"].items():
                setattr(model, name, int(value))
            for name, value in state["losses"].items():
                model.logger.record(name, float(value))
            if state["buffer"] is not None:
                restore_buffer(model.replay_buffer, state["buffer"])
        if model.num_timesteps:  # schedules depend on the progress
            model._update_current_progress_remaining(model.num_timesteps, self._run.total_timesteps)
            if hasattr(model, "exploration_schedule"):
                progress = model._current_progress_remaining
                model.exploration_rate = model.exploration_schedule(progress)

    def environment_state(self) -> dict[str, Any] | None:
        """Returns where all environments are; None before their first episodes."""
        return self._positions.state_dict()

    def start_environment(self, state: dict[str, Any] | None, say: Say) -> None:
        """Repeats the episodes under way. In a new training the model seeds and begins them.

        Demonstrations begin a new training's buffer.
        """
        if state is not None:
            for index in self._positions.load_state_dict(state):
                self._say_lost(index, say)
        elif self._demos and not self._model.replay_buffer.size():  # a checkpoint has them
            fill(self._model, Path(self._demos), self._run, say)

    def _say_lost(self, index: int, say: Say) -> None:
        count = self._model.n_envs
        which = "the environment" if count == 1 else f"environment {index + 1} of {count}"
        say(f"{which} is not repeatable: the current episode is truncated")

    def leave_environment(self) -> Any:
        # Evaluations only move the first environment.
        return self._positions.leave(0) if self._model._last_obs is not None else None

    def restore_environment(self, state: Any, say: Say) -> None:
        if state is not None and not self._positions.bring_back(state):
            self._say_lost(0, say)

    def export(self, folder: Path) -> None:
        write_atomically(folder / MODEL, self._model.save)


def _pending_losses(model: Any) -> dict[str, float]:
    """Returns the losses that the model has recorded since they were last logged, by its own names."""
    recorded = model.logger.name_to_value
    return {name: float(recorded[name]) for name in LOSSES if name in recorded}


class FrameCallback(BaseCallback):
    """Lets the frame evaluate and save between two rollouts, and stops when the frame says so.

    On-policy, an interrupt discards the rollout under way: its episodes are reported when it is complete.
    Off-policy, rollouts are short and change what was learned, so they are completed.
    """

    def __init__(self, frame: Training, positions: Positions, log_frequency: int) -> None:
        super().__init__()
        self._frame, self._positions, self._log_frequency = frame, positions, log_frequency
        self._ended: list[tuple[int, dict[str, Any]]] = []  # step and info, not reported yet
        self._episodes = 0
        self._held: int | None = None  # learning_starts, while hindsight has no whole episode
        self._mark: ModelMark | None = None
        self._can_go_back = False  # whether everything since the mark can be taken back

    def _on_training_start(self) -> None:
        model: Any = self.model
        self._arrived = model.num_timesteps
        self._is_on_policy = isinstance(model, OnPolicyAlgorithm)
        lengths = getattr(getattr(model, "replay_buffer", None), "ep_length", None)
        # Hindsight can't sample before the first episode has ended.
        if lengths is not None and not lengths.any():
            self._held, model.learning_starts = model.learning_starts, math.inf

    def goes_on(self) -> bool:
        """Returns whether there is to be another rollout. Called between two of them."""
        if self.model.num_timesteps > self._arrived:
            self._arrive()
        self._set_mark()
        return not self._frame.is_over()

    def _arrive(self) -> None:
        model: Any = self.model
        model.stride = model.num_timesteps - self._arrived
        self._arrived = model.num_timesteps
        self._log_losses(model)
        self._set_mark()
        self._frame.step_done()

    def _set_mark(self) -> None:
        self._mark, self._can_go_back = self._positions.mark(), True

    def go_back(self) -> bool:
        """Undoes the steps since the last rollout; returns whether it could."""
        if self._can_go_back and self._mark is not None:
            self._positions.take_back(self._mark)
        return self._can_go_back

    def _log_losses(self, model: Any) -> None:
        losses = {LOSSES[name]: value for name, value in _pending_losses(model).items()}
        for tag, value in losses.items():
            _check_finite(tag, value)
        steps, frequency = self._arrived, self._log_frequency
        if losses and steps // frequency > (steps - model.stride) // frequency:
            self._frame.log.add(steps, losses)
            model.logger.dump(steps)  # the logger has no outputs, so this only clears it

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:  # Monitor's figures
                self._ended.append((self.model.num_timesteps, info))
        if self._is_on_policy:
            return not self._frame.is_interrupted()
        self._can_go_back = False
        self._report()
        if self.locals["dones"].any():
            self._release()
        return True

    def _on_rollout_end(self) -> None:
        self._can_go_back = False
        self._report()

    def _report(self) -> None:
        for step, info in self._ended:
            self._episodes += 1
            total_reward, length = float(info["episode"]["r"]), int(info["episode"]["l"])
            _check_finite(f"the return of episode {self._episodes}", total_reward)
            success = succeeded(info)
            curves = info.get(CURVES, {})
            self._frame.episode_done(total_reward, length, curves, success=success, step=step)
        self._ended = []

    def _on_training_end(self) -> None:
        self._release()
        if not self.go_back() and self.model.num_timesteps > self._arrived:
            self._arrive()

    def _release(self) -> None:
        model: Any = self.model
        if self._held is not None:
            self._held, model.learning_starts = None, self._held


def _check_finite(name: str, value: float) -> None:
    if not math.isfinite(value):
        raise WorkbenchError(f"{name} is {value}: a smaller learning_rate may help")
