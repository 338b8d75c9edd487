"""Stable-Baselines3 at work: its own loop, with a callback that tells the frame."""

import math
from collections.abc import Callable, Mapping
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.type_aliases import RolloutReturn

from rl_workbench.errors import WorkbenchError
from rl_workbench.states import array, check_optimizer, number, whole
from rl_workbench.storage import write_atomically
from rl_workbench.training.algorithm import Algorithm, Frame, Policy, Say
from rl_workbench.training.checkpoints import fitting
from rl_workbench.training.environments import succeeded
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.sb3.acting import greedy_network
from rl_workbench.training.sb3.hyperparameters import ON_POLICY
from rl_workbench.training.sb3.models import algorithm_class, checked_of, make_model
from rl_workbench.training.sb3.positions import (
    ModelMark,
    Positions,
    buffer_state,
    cut_off,
    restore_buffer,
)

# What the library raises in the midst of learning: weights or options that are no good.
_LEARNING = (ArithmeticError, AssertionError, LookupError, RuntimeError, TypeError, ValueError)
MODEL = "model.zip"  # Stable-Baselines3's own form, for its own load()


def load_policy(
    options: TrainingOptions, content: dict[str, Any], env: gymnasium.Env[Any, Any]
) -> Policy:
    """The policy of a checkpoint; see `policy.load_policy`.

    The checkpoint holds plain tensors, and the model is made anew from the recorded options: so a
    foreign file can't run code, as it could in Stable-Baselines3's own zip.
    """
    model = make_model(options, acts_in=env)
    model.policy.load_state_dict(content["policy"])
    preference, meaning = _preference(model, options.kind.name, env.action_space)
    return Policy(
        lambda observation: model.policy.predict(observation, deterministic=True)[0],
        preference,
        meaning,
        greedy_network(model, options.kind.name),
    )


def _preference(
    model: Any, algorithm: str, space: gymnasium.Space[Any]
) -> tuple[Callable[[np.ndarray], np.ndarray], str]:
    """What it would rather do in observations (N, D), as (N,), and what these numbers mean."""
    if not isinstance(space, spaces.Discrete):
        return lambda seen: _first(model.policy.predict(seen, deterministic=True)[0]), "action"
    if algorithm in ON_POLICY:
        return lambda seen: _spread(_probabilities(model, seen)), "P(right) - P(left)"
    return lambda seen: _spread(model.q_net(_tensor(seen))), "Q(right) - Q(left)"


def _probabilities(model: Any, observations: np.ndarray) -> torch.Tensor:
    found: torch.Tensor = model.policy.get_distribution(_tensor(observations)).distribution.probs
    return found


def _tensor(observations: np.ndarray) -> torch.Tensor:
    return torch.as_tensor(observations, dtype=torch.float32)


def _first(actions: np.ndarray) -> np.ndarray:
    return np.asarray(actions, float).reshape(len(actions), -1)[:, 0]


def _spread(values: torch.Tensor) -> np.ndarray:
    """The last action's against the first one's, of (N, actions)."""
    return np.asarray((values[:, -1] - values[:, 0]).detach().cpu())


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
        self._mark: ModelMark | None = None
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


class OnPolicy(OnPolicyAlgorithm):
    """Mix-in for those that learn from a rollout and forget it."""

    stride = 0  # steps of the last rollout, in all environments

    def collect_rollouts(
        self, env: Any, callback: Any, rollout_buffer: Any, n_rollout_steps: int
    ) -> bool:
        """Collects a rollout, unless the callback has it end."""
        if not callback.goes_on():
            return False
        return super().collect_rollouts(env, callback, rollout_buffer, n_rollout_steps)


class OffPolicy(OffPolicyAlgorithm):
    """Mix-in for those with a replay buffer; a rollout is their `train_freq`."""

    stride = 0  # steps of the last rollout, in all environments

    def collect_rollouts(
        self, env: Any, callback: Any, *arguments: Any, **named: Any
    ) -> RolloutReturn:
        """Collects a rollout, unless the callback has it end."""
        if not callback.goes_on():
            return RolloutReturn(0, 0, continue_training=False)
        return super().collect_rollouts(env, callback, *arguments, **named)


def asking_class(name: str) -> Any:
    """The algorithm's class with its mix-in.

    Args:
        name: one of `options.CLASSES`.
    """
    own = algorithm_class(name)
    return type(own.__name__, (OnPolicy if name in ON_POLICY else OffPolicy, own), {})


COUNTERS = ("num_timesteps", "_episode_num", "_n_updates", "_n_calls", "stride")
ENTROPY = "log_ent_coef"  # SAC's, no part of a network
LOSSES = {  # Stable-Baselines3's names: our tags
    "train/loss": "losses/loss",
    "train/value_loss": "losses/value_loss",
    "train/policy_loss": "losses/policy_loss",
    "train/policy_gradient_loss": "losses/policy_loss",
    "train/actor_loss": "losses/actor_loss",
    "train/critic_loss": "losses/critic_loss",
}


def state_of(model: Any) -> dict[str, Any]:
    """Networks, optimizers, counters, losses to be logged, and the filled part of a replay buffer.

    Raises:
        WorkbenchError: if a weight isn't a number any more.
    """
    check_weights(model)
    parameters = model.get_parameters()
    policy = parameters.pop("policy")
    entropy = getattr(model, ENTROPY, None)
    return {
        "policy": policy,
        "optimizers": parameters,
        "entropy": None if entropy is None else entropy.detach(),
        "counters": {name: getattr(model, name) for name in COUNTERS if hasattr(model, name)},
        "losses": losses_of(model),
        "buffer": buffer_state(getattr(model, "replay_buffer", None)),
    }


def losses_of(model: Any) -> dict[str, float]:
    """The last ones that the model has told since they were logged, by its own names."""
    told = model.logger.name_to_value
    return {name: float(told[name]) for name in LOSSES if name in told}


def check_weights(model: Any) -> None:
    """Refuses weights that are none: they would act, too, and be taken for a policy.

    Raises:
        WorkbenchError: if one isn't a number any more.
    """
    if not all(torch.isfinite(each).all() for each in model.policy.parameters()):
        raise WorkbenchError(
            "the weights are no numbers any more: a smaller learning_rate may help"
        )


def restore(model: Any, state: dict[str, Any], total_timesteps: int) -> None:
    """Lets a new model go on from what `state_of` gave.

    Args:
        model: new.
        state: what it gave; by an earlier version without `losses` and `stride`.
        total_timesteps: of the training: rates that fall over its length depend on it.

    Raises:
        WorkbenchError: if the state is another model's.
    """
    with fitting("model"):
        new = state_of(model)
        counters, losses = state["counters"], state.get("losses", {})
        if isinstance(counters, dict):
            counters = {"stride": model.n_envs, **counters}
        for part, found in (("optimizers", state["optimizers"]), ("counters", counters)):
            if not isinstance(found, dict) or set(found) != set(new[part]):
                raise ValueError(f"{part} are {found!r}")
        for name, optimizer in state["optimizers"].items():
            check_optimizer(attrgetter(name)(model), optimizer)
        model.set_parameters({"policy": state["policy"], **state["optimizers"]})
        if new["entropy"] is not None:
            entropy = array(state["entropy"], new["entropy"].dtype, tuple(new["entropy"].shape))
            getattr(model, ENTROPY).data.copy_(torch.from_numpy(entropy))
        if counters["num_timesteps"] != whole(state["steps"]):
            raise ValueError(f"{counters['num_timesteps']} steps of {state['steps']}")
        for name, value in counters.items():
            setattr(model, name, whole(value))
        if not isinstance(losses, dict) or not set(losses) <= set(LOSSES):
            raise ValueError(f"losses are {losses!r}")
        for name, value in losses.items():
            model.logger.record(name, number(value))
        if new["buffer"] is not None:
            restore_buffer(model.replay_buffer, state["buffer"])
        if model.num_timesteps:
            _set_progress(model, total_timesteps)


def _set_progress(model: Any, total_timesteps: int) -> None:
    """What follows from how far it is."""
    model._update_current_progress_remaining(model.num_timesteps, total_timesteps)
    if hasattr(model, "exploration_schedule"):
        model.exploration_rate = model.exploration_schedule(model._current_progress_remaining)


class SB3Training(Algorithm):
    """A model of Stable-Baselines3; evaluated and saved between two rollouts.

    Args:
        options: what the user chose.
        model: with its environments.
        env: one of them, or of their kind.
    """

    def __init__(self, options: TrainingOptions, model: Any, env: gymnasium.Env[Any, Any]) -> None:
        self._run, self._name, self._model, self.env = options.run, options.kind.name, model, env
        self._positions = Positions(model)
        self._course: FrameCallback | None = None  # of its learning

    @property
    def steps(self) -> int:
        """See `Algorithm.steps`."""
        return int(self._model.num_timesteps)

    @property
    def stride(self) -> int:
        """The steps of a rollout."""
        return int(self._model.stride)

    def act_greedily(self, observation: np.ndarray) -> Any:
        """See `Algorithm.act_greedily`."""
        return self._model.policy.predict(observation, deterministic=True)[0]

    def learn(self, frame: Frame) -> None:
        """See `Algorithm.learn`."""
        remaining = max(self._run.total_timesteps - self.steps, 0)
        self._course = self._callback(frame)
        try:
            self._model.learn(
                remaining,
                callback=self._course,
                log_interval=None,  # losses are logged between two rollouts
                reset_num_timesteps=False,
            )
        except WorkbenchError:
            raise
        except _LEARNING as error:
            self.check_weights()  # torch tells of it in its own words, if at all
            text = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise WorkbenchError(f"{self._name} failed: {text}") from error

    def _callback(self, frame: Frame) -> FrameCallback:
        return FrameCallback(frame, self._positions, self._run.log_frequency)

    def settle(self) -> bool:
        """Takes back what was played since the last rollout; what was learned by halves can't be."""
        return self._course is not None and self._course.go_back()

    def check_weights(self) -> None:
        """See `Algorithm.check_weights`."""
        check_weights(self._model)

    def state_dict(self) -> dict[str, Any]:
        """See `Algorithm.state_dict`."""
        return state_of(self._model)

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """See `Algorithm.load_state_dict`."""
        restore(self._model, state, self._run.total_timesteps)

    def environment_state(self) -> dict[str, Any] | None:
        """Where all environments are; None before their first episodes."""
        return self._positions.state_dict()

    def start_environment(self, state: dict[str, Any] | None, say: Say) -> None:
        """Repeats the episodes under way. At the beginning, the model seeds and begins them."""
        if state is not None:
            for index in self._positions.load_state_dict(state):
                self._say_lost(index, say)
        elif self.steps:
            self._begin_anew()
            say(
                "its checkpoint is of an earlier version, which kept no episodes: it goes on with new ones "
                "and other random numbers"
            )

    def _begin_anew(self) -> None:
        """Other episodes than at the start, or the same ones would be explored again."""
        self._model.set_random_seed((self._run.seed + self.steps) % 2**31)
        for index in range(self._model.n_envs):
            cut_off(getattr(self._model, "replay_buffer", None), index)

    def _say_lost(self, index: int, say: Say) -> None:
        count = self._model.n_envs
        which = "the environment" if count == 1 else f"environment {index + 1} of {count}"
        say(f"{which} doesn't repeat itself: the episode under way is cut off")

    def leave_environment(self) -> Any:
        """See `Algorithm.leave_environment`; it is the first one that evaluations move."""
        return self._positions.leave(0) if self._model._last_obs is not None else None

    def restore_environment(self, state: Any, say: Say) -> None:
        """Repeats the episode under way; says so if it goes another way."""
        if state is not None and not self._positions.bring_back(state):
            self._say_lost(0, say)

    def export(self, folder: Path) -> None:
        """Writes model.zip, for Stable-Baselines3's own load()."""
        write_atomically(folder / MODEL, self._model.save)

    def close(self) -> None:
        """Closes all environments."""
        self._model.get_env().close()


def make(options: TrainingOptions) -> SB3Training:
    """A new training; see `make_algorithm`."""
    if not options.run.total_timesteps:
        raise WorkbenchError(
            f"{options.kind.name} needs total_timesteps: its schedules depend on them"
        )
    model = make_model(options)
    return SB3Training(options, model, checked_of(model.get_env()))
