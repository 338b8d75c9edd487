"""All that a model of Stable-Baselines3 has learned, and needs to go on, as plain values and tensors.

Not in it: where its environments are (`positions.py`), and the generators of the process.
"""

from operator import attrgetter
from typing import Any

import torch

from rl_workbench.errors import WorkbenchError
from rl_workbench.states import array, check_optimizer, number, whole
from rl_workbench.training.run.checkpoints import fitting
from rl_workbench.training.sb3.buffer import buffer_state, restore_buffer

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
