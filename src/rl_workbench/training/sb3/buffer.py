"""A replay buffer of Stable-Baselines3, as plain values and tensors."""

from typing import Any

import numpy as np
import torch

from rl_workbench.states import array, switch, whole

ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts",
          "ep_start", "ep_length")  # fmt: skip
EPISODES = "_current_ep_start"  # of a buffer for hindsight


def buffer_state(buffer: Any) -> dict[str, Any] | None:
    """Its filled part; None if there is no buffer."""
    if buffer is None:
        return None
    count = buffer.size()
    state = {
        "position": buffer.pos,
        "full": buffer.full,
        "arrays": {name: torch.from_numpy(own[:count]) for name, own in _arrays(buffer).items()},
    }
    if hasattr(buffer, EPISODES):
        state["episodes"] = torch.from_numpy(getattr(buffer, EPISODES))
    return state


def _arrays(buffer: Any) -> dict[str, np.ndarray]:
    """All that it holds of each step; of a Dict of observations each part."""
    found: dict[str, np.ndarray] = {}
    for name in ARRAYS:
        own = getattr(buffer, name, None)
        if isinstance(own, dict):
            found |= {f"{name}/{key}": part for key, part in own.items()}
        elif isinstance(own, np.ndarray):
            found[name] = own
    return found


def restore_buffer(buffer: Any, state: dict[str, Any]) -> None:
    """Fills a new buffer with what `buffer_state` gave.

    Raises:
        TypeError, ValueError, LookupError: if the state is another buffer's.
    """
    position, is_full = whole(state["position"]), switch(state["full"])
    count = buffer.buffer_size if is_full else position
    if position >= buffer.buffer_size:
        raise ValueError(f"place {position} in a buffer of {buffer.buffer_size}")
    for name, own in _arrays(buffer).items():
        own[:count] = _like(own, state["arrays"][name], (count, *own.shape[1:]))
    buffer.pos, buffer.full = position, is_full
    if hasattr(buffer, EPISODES):
        own = getattr(buffer, EPISODES)
        own[:] = _like(own, state["episodes"], own.shape)
        _check_episodes(buffer)


def _like(own: np.ndarray, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    return array(value, torch.from_numpy(own[:0]).dtype, shape)


def _check_episodes(buffer: Any) -> None:
    """Episodes that lie elsewhere would be looked up there."""
    size = buffer.buffer_size
    for name in ("ep_start", "ep_length", EPISODES):
        own = getattr(buffer, name)
        if own.min() < 0 or own.max() > size:
            raise ValueError(f"{name} beyond a buffer of {size}")


def cut_off(buffer: Any, index: int) -> None:
    """Has the episode of an environment end with the last step that the buffer has of it, as at a time limit.

    Args:
        buffer: of an algorithm that learns off-policy; of others None.
        index: of the environment.
    """
    if buffer is None or not buffer.size() or buffer.dones[buffer.pos - 1, index]:
        return
    buffer.dones[buffer.pos - 1, index] = buffer.timeouts[buffer.pos - 1, index] = True
    if hasattr(buffer, EPISODES):
        buffer._compute_episode_length(index)
