"""Demonstrations, recorded in this process."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium

from rl_workbench.training.demonstrations import Origin, Recorder, save


def recorded(
    folder: Path,
    env_id: str,
    lengths: tuple[int, ...],
    act: Callable[[Any, gymnasium.Env], Any] = lambda seen, env: env.action_space.sample(),
    success: bool | None = None,
    **options: Any,
) -> Path:
    """Episodes of so many steps each, after which a driver stops them."""
    folder.mkdir(parents=True)
    origin = Origin(env_id, options)
    env = origin.make()
    env.action_space.seed(1)
    recorder = Recorder(env, origin)
    for seed, length in enumerate(lengths):
        seen = recorder.begin(seed)
        for _ in range(length):
            seen = recorder.step(act(seen, env))
        save(folder, recorder.episode(success))
    env.close()
    return folder
