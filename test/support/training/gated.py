"""A pole whose episodes stop at gates until a test opens them, so that something happens in their midst.

support.training.gated:Gated-v0, for processes that have test/ on PYTHONPATH
"""

import os
import time
from pathlib import Path

import gymnasium
from support.training.learning_fakes import Pole

PATIENCE = 600.0  # [s] that a gate may be closed for


class Gated(Pole):
    """A pole that stops in the middle of an episode.

    Args:
        gates: a folder. Where it holds a file that is called as the episode, counted in its process, that
            one stops at its third step, and tells by a file NUMBER.PID, until the file is gone.
    """

    def __init__(self, gates: str) -> None:
        super().__init__(noise=0.05)
        self._gates, self._episodes, self._steps = Path(gates), 0, 0

    def reset(self, *, seed=None, options=None):
        self._episodes, self._steps = self._episodes + 1, 0
        return super().reset(seed=seed, options=options)

    def step(self, action):
        self._steps += 1
        gate = self._gates / str(self._episodes)
        if self._steps == 3 and gate.exists():
            Path(f"{gate}.{os.getpid()}").touch()
            until = time.monotonic() + PATIENCE
            while gate.exists():
                assert time.monotonic() < until, f"nobody opens {gate}"
                time.sleep(0.01)
        return super().step(action)


gymnasium.register("Gated-v0", Gated, max_episode_steps=100, disable_env_checker=True)
