"""PPO and A2C that learn from fragments, which workers play for them."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import gymnasium
from stable_baselines3 import A2C, PPO
from stable_baselines3.common.vec_env import DummyVecEnv

from rl_workbench.errors import WorkbenchError
from rl_workbench.states import sequence
from rl_workbench.training.environments.elsewhere import Elsewhere
from rl_workbench.training.options.training_options import MakePool, TrainingOptions
from rl_workbench.training.player import Pool
from rl_workbench.training.run.algorithm import Frame, Say, environments_elsewhere
from rl_workbench.training.run.checkpoints import fitting
from rl_workbench.training.run.progress import tell
from rl_workbench.training.sb3.algorithm import SB3Training
from rl_workbench.training.sb3.callback import FrameCallback
from rl_workbench.training.sb3.fragments import ARRAYS, Fragment
from rl_workbench.training.sb3.model import check_fit, model_in
from rl_workbench.training.sb3.rollouts import OnPolicy
from rl_workbench.training.sb3.state import FRAGMENTS, restore


def make_remote(options: TrainingOptions, make_pool: MakePool) -> "RemoteTraining":
    """A training by fragments that workers play; see `make_algorithm`."""
    here, theirs = environments_elsewhere(options)
    model = _make_model(options, here)
    return RemoteTraining(options, model, here, make_pool(theirs))


def _make_model(options: TrainingOptions, env: Elsewhere) -> Any:
    name, run = options.kind.name, options.run
    check_fit(name, run.env_id, env.action_space)
    vector = DummyVecEnv([partial(Elsewhere, env)] * run.num_envs)
    return model_in(vector, options, options.hyperparameters.own, _CLASSES[name])


class FromFragments(OnPolicy):
    """Mix-in: rollouts come from workers; all else is the algorithm's own.

    Between two rollouts `states` tell where the environments are.
    """

    pool: Pool
    states: list[Any]

    def collect_rollouts(
        self, env: Any, callback: Any, rollout_buffer: Any, n_rollout_steps: int
    ) -> bool:
        """Fills the buffer with the fragments side by side, in the order of the environments."""
        if not callback.goes_on():
            return False
        policy = {name: each.cpu() for name, each in self.policy.state_dict().items()}
        fragments = callback.collect(self.pool, policy, self.states)
        if fragments is None:
            return False
        self.states = [each.state for each in fragments]
        rollout_buffer.reset()
        for index, fragment in enumerate(fragments):
            for name in ARRAYS:
                _put(getattr(rollout_buffer, name), index, fragment.arrays[name])
        rollout_buffer.pos, rollout_buffer.full = n_rollout_steps, True
        callback.take(fragments, n_rollout_steps)
        callback.on_rollout_end()
        return True


class RemotePPO(FromFragments, PPO):
    """PPO of rollouts that workers play."""


class RemoteA2C(FromFragments, A2C):
    """A2C of rollouts that workers play."""


_CLASSES = {"ppo": RemotePPO, "a2c": RemoteA2C}


def _put(place: Any, index: int, part: Any) -> None:
    """Fills a column; of a dict of observations each part's."""
    if isinstance(place, dict):
        for name, own in place.items():
            _put(own, index, part[name])
    else:
        place[:, index] = part[:, 0]


class RemoteTraining(SB3Training):
    """A model of Stable-Baselines3 whose rollouts workers play.

    It is evaluated and saved between two rollouts, and goes on from there to the same bits.

    Args:
        options: what the user chose.
        model: by `FromFragments`.
        env: of the kind that is learned in.
        pool: plays the fragments; closed with this.
    """

    def __init__(
        self, options: TrainingOptions, model: Any, env: gymnasium.Env[Any, Any], pool: Pool
    ) -> None:
        super().__init__(options, model, env)
        model.pool, model.states = pool, [None] * options.run.num_envs

    def _callback(self, frame: Frame) -> FrameCallback:
        return FragmentCallback(frame, None, self._run.log_frequency)

    def state_dict(self) -> dict[str, Any]:
        """See `Algorithm.state_dict`."""
        return {**super().state_dict(), FRAGMENTS: self._model.states}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """See `Algorithm.load_state_dict`."""
        if FRAGMENTS not in state:
            raise WorkbenchError("it was begun without --ray: it goes on without")
        restore(self._model, state, self._run.total_timesteps)
        with fitting("environments"):
            self._model.states = sequence(state[FRAGMENTS], self._model.n_envs)

    def environment_state(self) -> None:
        """None: the workers tell where their environments are."""

    def start_environment(self, state: Any, say: Say) -> None:
        """Nothing to do: the workers are told where their environments are."""

    def close(self) -> None:
        """Closes all environments."""
        self._model.pool.close()


class FragmentCallback(FrameCallback):
    """Tells the frame of the episodes of whole rollouts; one that is broken off changes nothing."""

    def collect(self, pool: Pool, policy: Any, states: Sequence[Any]) -> list[Fragment] | None:
        """The fragments; None if the training is over."""
        return pool.play(policy, states, self._frame.is_interrupted)

    def take(self, fragments: Sequence[Fragment], length: int) -> None:
        """Takes down the episodes in the order in which they ended.

        Args:
            fragments: of a rollout.
            length: of each [steps].
        """
        model: Any = self.model
        before, count = model.num_timesteps, len(fragments)
        for index, fragment in enumerate(fragments):
            if fragment.was_cut:
                tell(
                    f"environment {index + 1} of {count} doesn't repeat itself: its episode was cut off"
                )
        ended = [
            (each.step, index, each) for index, one in enumerate(fragments) for each in one.ended
        ]
        self._ended = [
            each._replace(step=before + (step + 1) * count) for step, _, each in sorted(ended)
        ]
        model.num_timesteps = before + length * count
