"""What a training learned, as a function of observations."""

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from torch import nn

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options.training_options import TrainingOptions


class Policy(NamedTuple):
    """A learned policy."""

    act: Callable[[Any], Any]  # greedily, for one observation: (D,), or a dict as it learned from
    preference: Callable[[np.ndarray], np.ndarray]  # of (N, D): (N,), see meaning
    meaning: str  # of the preference: positive is the last action, or a push to the right
    network: nn.Module  # for TorchScript: of (N, D), float32, a Dict's parts side by side: (N, ...)


def load_policy(
    options: TrainingOptions, content: dict[str, Any], env: gymnasium.Env[Any, Any], origin: str
) -> Policy:
    """The policy of a checkpoint that was read already.

    Args:
        options: of the training that it is of.
        content: of the checkpoint.
        env: of the kind that it learned in.
        origin: its file, for the error.

    Raises:
        WorkbenchError: if the checkpoint doesn't fit options or environment.
    """
    try:
        made: Policy = import_module(options.kind.implementation).load_policy(options, content, env)
        return made
    except (KeyError, TypeError, ValueError, RuntimeError, AttributeError) as error:
        reason = str(error).split("\n")[0]
        raise WorkbenchError(f"{origin} doesn't fit {options.run.env_id}: {reason}") from error
