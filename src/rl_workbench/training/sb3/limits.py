"""Limits of Stable-Baselines3's options that it doesn't check itself."""

from collections.abc import Mapping
from typing import Any

from rl_workbench.errors import WorkbenchError

INFINITE = float("inf")
LIMITS = {
    "gamma": (0.0, 1.0),
    "gae_lambda": (0.0, 1.0),
    "tau": (0.0, 1.0),
    "n_epochs": (1, INFINITE),
    "n_steps": (1, INFINITE),
    "batch_size": (1, INFINITE),
    "buffer_size": (1, INFINITE),
    "learning_starts": (0, INFINITE),
    "policy_delay": (1, INFINITE),
    "target_update_interval": (1, INFINITE),
    "exploration_fraction": (0.0, 1.0),
    "exploration_initial_eps": (0.0, 1.0),
    "exploration_final_eps": (0.0, 1.0),
}


def check_limits(hyperparameters: Mapping[str, Any]) -> None:
    """Refuses numbers with which nothing can be learned.

    Raises:
        WorkbenchError: if one is beyond its limits, or no number, or not a whole one.
    """
    for name, (lowest, highest) in LIMITS.items():
        value = hyperparameters.get(name)
        if name in hyperparameters and not _lies_within(value, lowest, highest):
            kind = "a whole number" if isinstance(lowest, int) else "a number"
            until = "on" if highest == INFINITE else f"to {highest:g}"
            raise WorkbenchError(f"{name} is {kind} from {lowest:g} {until}, not {value!r}")


def _lies_within(value: Any, lowest: float, highest: float) -> bool:
    kinds = int if isinstance(lowest, int) else (int, float)
    return isinstance(value, kinds) and not isinstance(value, bool) and lowest <= value <= highest
