"""All that a model of Stable-Baselines3 needs to go on learning, as plain values and tensors.

Not in it: the state of the environment and of the random generators, and a rollout that isn't
whole yet. So a resumed training begins a new episode, and isn't the same to the bit.
"""

import warnings
from operator import attrgetter
from typing import Any

import numpy as np
import torch

from rl_workbench.errors import WorkbenchError
from rl_workbench.states import array, check_optimizer, switch, whole
from rl_workbench.training.run.checkpoints import fitting

COUNTERS = ("num_timesteps", "_episode_num", "_n_updates", "_n_calls")
ENTROPY = "log_ent_coef"  # SAC's, no part of a network
ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts",
          "ep_start", "ep_length")  # fmt: skip
FRAGMENTS = "fragments"  # where the environments are of which workers play fragments
EPISODES = "_current_ep_start"  # of a buffer for hindsight


def state_of(model: Any) -> dict[str, Any]:
    """Networks, optimizers, counters and the filled part of a replay buffer.

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
        "buffer": _buffer_state(getattr(model, "replay_buffer", None)),
    }


def check_weights(model: Any) -> None:
    """Refuses weights that are none: they would act, too, and be taken for a policy.

    Raises:
        WorkbenchError: if one isn't a number any more.
    """
    if not all(torch.isfinite(each).all() for each in model.policy.parameters()):
        raise WorkbenchError(
            "the weights are no numbers any more: a smaller learning_rate may help"
        )


def restore(model: Any, state: dict[str, Any], seed: int) -> None:
    """Lets a new model go on from what `state_of` gave.

    Args:
        seed: of the training.

    Raises:
        WorkbenchError: if the state is another model's.
    """
    with fitting("model"):
        new = state_of(model)
        for part in ("optimizers", "counters"):
            if not isinstance(state[part], dict) or set(state[part]) != set(new[part]):
                raise ValueError(f"{part} are {state[part]!r}")
        for name, optimizer in state["optimizers"].items():
            check_optimizer(attrgetter(name)(model), optimizer)
        model.set_parameters({"policy": state["policy"], **state["optimizers"]})
        if new["entropy"] is not None:
            entropy = array(state["entropy"], new["entropy"].dtype, tuple(new["entropy"].shape))
            getattr(model, ENTROPY).data.copy_(torch.from_numpy(entropy))
        for name, value in state["counters"].items():
            setattr(model, name, whole(value))
        if new["buffer"] is not None:
            _restore_buffer(model.replay_buffer, state["buffer"])
        # Another seed than at the start, or the same episodes would be explored again.
        model.set_random_seed((seed + whole(state["steps"])) % 2**31)


def _buffer_state(buffer: Any) -> dict[str, Any] | None:
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


def _restore_buffer(buffer: Any, state: dict[str, Any]) -> None:
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
        with warnings.catch_warnings():  # that it does so
            warnings.simplefilter("ignore")
            buffer.truncate_last_trajectory()


def _like(own: np.ndarray, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    return array(value, torch.from_numpy(own[:0]).dtype, shape)


def _check_episodes(buffer: Any) -> None:
    """Episodes that lie elsewhere would be looked up there."""
    size = buffer.buffer_size
    for name in ("ep_start", "ep_length", EPISODES):
        own = getattr(buffer, name)
        if own.min() < 0 or own.max() > size:
            raise ValueError(f"{name} beyond a buffer of {size}")
