"""Fragments of episodes, as Stable-Baselines3's own loop collects them in a worker's environment."""

from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv

from rl_workbench.training.options.training_options import TrainingOptions
from rl_workbench.training.player import Player
from rl_workbench.training.run.algorithm import environment_for
from rl_workbench.training.run.random_states import random_states, restore_random_states
from rl_workbench.training.sb3.callback import Ended, ended
from rl_workbench.training.sb3.model import model_in, watched
from rl_workbench.training.sb3.positions import Positions

ARRAYS = ("observations", "actions", "rewards", "episode_starts", "values", "log_probs", "advantages",
          "returns")  # fmt: skip


class Fragment(NamedTuple):
    """One environment's part of a rollout."""

    arrays: dict[str, Any]  # of the buffer by name, (n_steps, 1, ...); observations may be a dict
    ended: list[Ended]  # their steps are counted in the fragment, from 0 on
    was_cut: bool  # the episode under way before couldn't be brought back
    state: dict[str, Any]  # from which the next fragment goes on


class FragmentPlayer(Player):
    """Plays fragments in one environment, with a model of its own that only acts.

    Args:
        options: of the training.
        index: of the environment: its seed, and that of its actions, is the training's + index.

    Raises:
        WorkbenchError: if the environment can't be made.
    """

    def __init__(self, options: TrainingOptions, index: int) -> None:
        self._seed = (options.run.seed + index) % 2**31
        run = replace(options.run, seed=self._seed, device="cpu", num_envs=1)
        env = environment_for(options, run.training_environment)
        vector = DummyVecEnv([partial(watched, env)])
        own = options.hyperparameters.own
        self._model: Any = model_in(vector, options._replace(run=run), own)
        self._positions = Positions(self._model)
        self._generators = random_states()  # as the model begins with, after its weights
        self._told = _Told()
        self._done: int | None = None  # fragments

    def play(self, policy: Any, state: Any) -> Fragment:
        """See `Player.play`.

        Args:
            policy: its state_dict, on the CPU.
            state: of the last fragment; None for the first one.
        """
        model = self._model
        was_cut = self._go_to(state)
        model.policy.load_state_dict(policy)
        model.collect_rollouts(model.env, self._told, model.rollout_buffer, model.n_steps)
        arrays = {name: getattr(model.rollout_buffer, name) for name in ARRAYS}
        self._done = 1 + (0 if state is None else state["fragments"])
        return Fragment(arrays, self._told.ended, was_cut, self._state())

    def _go_to(self, state: dict[str, Any] | None) -> bool:
        """Brings the environment to where a fragment ended; returns whether its episode had to be cut off."""
        was_cut = False
        if state is None or self._done != state["fragments"]:
            self._begin()
            if state is not None:
                was_cut = bool(self._positions.load_state_dict(state["environment"]))
        if state is not None:
            restore_random_states(state["random"])
        return was_cut

    def _begin(self) -> None:
        model = self._model
        restore_random_states(self._generators)
        model.env.seed(self._seed)
        model._setup_learn(model.n_steps, self._told)

    def _state(self) -> dict[str, Any]:
        """Plain values and tensors."""
        return {
            "fragments": self._done,
            "random": random_states(),
            "environment": self._positions.state_dict(),
        }

    def close(self) -> None:
        """See `Player.close`."""
        self._model.env.close()


class _Told(BaseCallback):
    """Remembers the episodes that end in a fragment."""

    def __init__(self) -> None:
        super().__init__()
        self.ended: list[Ended] = []
        self._steps = 0

    def _on_rollout_start(self) -> None:
        self.ended, self._steps = [], 0

    def _on_step(self) -> bool:
        info = self.locals["infos"][0]
        if "episode" in info:
            self.ended.append(ended(info, self._steps))
        self._steps += 1
        return True
