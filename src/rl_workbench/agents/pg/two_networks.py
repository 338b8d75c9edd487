"""What the learners from whole episodes have in common: two networks, and what is to be saved."""

import json
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import torch
from torch import nn

from rl_workbench.states import load_optimizer, set_generator


class TwoNetworks(ABC):
    """A policy and a value network, each with an Adam, and a generator that draws actions.

    Args:
        policy: observations (N, D) to probabilities (N, A).
        value: observations (N, D) to estimated returns (N, 1).
        rates: the learning rates of the two.
        seed: of the generator.
    """

    def __init__(
        self, policy: nn.Module, value: nn.Module, rates: tuple[float, float], seed: int
    ) -> None:
        self.policy = policy
        self.value = value
        self.policy_optimizer = torch.optim.Adam(policy.parameters(), rates[0])
        self.value_optimizer = torch.optim.Adam(value.parameters(), rates[1])
        self.generator = np.random.default_rng(seed)

    @abstractmethod
    def sync(self) -> None:
        """Copies the policy's weights to where acting reads them."""

    def _parts(self) -> dict[str, Any]:
        return {
            "policy": self.policy,
            "value": self.value,
            "policy_optimizer": self.policy_optimizer,
            "value_optimizer": self.value_optimizer,
        }

    def state_dict(self) -> dict[str, Any]:
        """All that is needed to go on learning to the same bits: tensors, numbers, texts."""
        return {
            **{name: part.state_dict() for name, part in self._parts().items()},
            "generator": json.dumps(self.generator.bit_generator.state),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Takes over what `state_dict` gave."""
        self.policy.load_state_dict(state["policy"])
        self.value.load_state_dict(state["value"])
        load_optimizer(self.policy_optimizer, state["policy_optimizer"])
        load_optimizer(self.value_optimizer, state["value_optimizer"])
        set_generator(self.generator, state["generator"])
        self.sync()
