"""The interface between a training's frame (training.py) and its algorithm.

The frame makes the environments, opens and resumes, evaluates, saves and reports. An algorithm provides its
learning loop and the content of a checkpoint. Its module has two functions:

    make(options, envs) -> Algorithm                     new, in the training's environments
    load_policy(options, checkpoint, env) -> Policy      of a checkpoint's content
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.checked import Env
from rl_workbench.training.options import TrainingOptions

Say = Callable[[str], None]  # reports a line to the user


class Algorithm(ABC):
    """One algorithm at work in its environments."""

    @property
    @abstractmethod
    def steps(self) -> int:
        """Steps of the environment that were learned from."""

    @property
    def stride(self) -> int:
        """Steps between the last two calls of `step_done`."""
        return 1

    def start_environment(self, state: Any, say: Say) -> None:
        """Seeds the environment, then restores `environment_state` unless that is None; says if it fails."""
        return

    @abstractmethod
    def learn(self, frame: Any) -> None:
        """Learns until `frame.is_over()`, and calls `frame.step_done()` wherever it can be saved."""

    @abstractmethod
    def act_greedily(self, observation: np.ndarray) -> Any:
        """Returns the best action for an observation (D,)."""

    def check_weights(self) -> None:
        """Checks the weights for NaN, if learning doesn't."""
        return

    @abstractmethod
    def state_dict(self) -> dict[str, Any]:
        """Returns all that it learned, as plain values and tensors."""

    @abstractmethod
    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Loads what `state_dict` returned, from a checkpoint that may hold more."""

    def environment_state(self) -> Any:
        """Returns where the environment is, as plain values and tensors; None if no episode matters."""
        return None

    def leave_environment(self) -> Any:
        """Returns what `restore_environment` needs after an evaluation in this environment."""
        return self.environment_state()

    def restore_environment(self, state: Any, say: Say) -> None:
        """Restores what `leave_environment` returned, after an evaluation; says if that fails."""
        return

    def settle(self) -> bool:
        """Discards unfinished work after a failure; returns whether the training can now be saved."""
        return False

    def export(self, folder: Path) -> None:
        """Writes the networks in further formats, if it has any; raises OSError if that fails."""
        return


def check_finite(parameters: Iterable[torch.Tensor]) -> None:
    """Refuses weights that are NaN or infinite."""
    if not all(torch.isfinite(each).all() for each in parameters):
        raise WorkbenchError("the weights are NaN or infinite: a smaller learning_rate may help")


def check_device(name: str) -> None:
    """Refuses a device that torch doesn't have here: Stable-Baselines3 would take the CPU instead."""
    try:
        torch.empty(0, device=name)
    except (RuntimeError, AssertionError) as error:
        reason = str(error).split("\n")[0]
        raise WorkbenchError(f"torch can't use the device {name!r}: {reason}") from error


class Policy(NamedTuple):
    """A learned policy."""

    act: Callable[[Any], Any]  # greedily, for one observation: (D,), or a dict as it learned from
    # For TorchScript: of (N, D), float32, a Dict's parts side by side: (N, ...); None if it can't be.
    network: nn.Module | None


def load_policy(options: TrainingOptions, content: dict[str, Any], env: Env, origin: str) -> Policy:
    """Makes the policy of a checkpoint, for an environment like its own; `origin` is the file, for errors."""
    try:
        made: Policy = import_module(options.kind.implementation).load_policy(options, content, env)
        return made
    except (LookupError, TypeError, ValueError, RuntimeError, AttributeError) as error:
        reason = str(error).split("\n")[0]
        raise WorkbenchError(f"{origin} doesn't fit {options.run.env_id}: {reason}") from error
