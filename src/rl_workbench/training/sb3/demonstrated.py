"""Demonstrations as the start of a replay buffer."""

from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.preprocessing import maybe_transpose

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithm import Say
from rl_workbench.training.demonstrations import load_all, replay
from rl_workbench.training.options import RunOptions


def fill(model: Any, folder: Path, run: RunOptions, say: Say) -> None:
    """Replays the demonstrations of a folder, with their own options, into a model's buffer.

    An episode that was stopped ends there, as at a time limit. Environments have a column each in the buffer,
    which all get the same. Raises WorkbenchError if the demonstrations are of another environment, go another
    way than they did, or don't fit into the buffer.
    """
    episodes = load_all(folder)
    origin = next(iter(episodes.values())).origin
    if not origin.same_id(run.env_id):
        raise WorkbenchError(f"{folder} is of {origin.env_id}, not of {run.env_id}")
    buffer, steps = model.replay_buffer, sum(len(each.actions) for each in episodes.values())
    if steps > buffer.buffer_size:
        raise WorkbenchError(
            f"{folder} has {steps} steps, but the replay buffer holds {buffer.buffer_size} (buffer_size)"
        )
    with closing(origin._replace(wrapper=run.wrapper).make()) as env:
        for name in ("observation_space", "action_space"):
            has, wanted = getattr(env, name), getattr(model.get_env().envs[0], name)
            if has != wanted:
                text = f"{folder} has the {name} {has}, {run.env_id} with these options {wanted}"
                raise WorkbenchError(" ".join(text.split()))
        for path, episode in episodes.items():
            exactly = origin.wrapper == run.wrapper
            first, *others = replay(path, episode, env, exactly)
            before = _columns(model, first.observation)
            for number, played in enumerate(others, 1):
                after, is_last = _columns(model, played.observation), number == len(others)
                cut_off = is_last and not played.terminated
                _add(model, before, after, played.action, played.reward, is_last, cut_off)
                before = after
    say(f"{len(episodes)} demonstrations, {steps} steps, begin the replay buffer: {folder}")


def _add(model: Any, before: Any, after: Any, action: Any, reward: float, ended: bool, cut_off: bool) -> None:
    count, space = model.n_envs, model.action_space
    stored = model.policy.scale_action(action) if isinstance(space, spaces.Box) else action
    model.replay_buffer.add(
        before, after, np.repeat(np.asarray(stored)[None], count, 0), np.full(count, reward),
        np.full(count, ended), [{"TimeLimit.truncated": cut_off}] * count,
    )  # fmt: skip


def _columns(model: Any, observation: Any) -> Any:
    """Returns an observation as the model's environments would give it together."""

    def repeated(part: Any, space: spaces.Space[Any]) -> np.ndarray:
        return np.repeat(maybe_transpose(np.asarray(part), space)[None], model.n_envs, 0)

    space = model.observation_space
    if isinstance(space, spaces.Dict):
        return {name: repeated(observation[name], part) for name, part in space.items()}
    return repeated(observation, space)
