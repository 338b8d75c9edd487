"""Base of policy-gradient agents: episodes, policy and value networks, losses, gradient steps."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from rl_workbench.agents.adam import Adam
from rl_workbench.errors import WorkbenchError
from rl_workbench.states import generator_state, load_optimizer, set_generator


@dataclass
class Episode:
    """One episode, step by step: the observation before the action, the action, the reward."""

    observations: list[np.ndarray] = field(default_factory=list)  # each float32 (D,)
    actions: list[Any] = field(default_factory=list)  # indices, or arrays (n,), float32
    rewards: list[float] = field(default_factory=list)
    final_observation: np.ndarray | None = None  # after the last step
    terminated: bool = False  # by the task; False: it was cut off
    success: bool | None = None  # None if the environment doesn't say
    curves: dict[str, float] = field(default_factory=dict)  # by tag: means of its infos

    def add(self, observation: np.ndarray, action: Any, reward: float) -> None:
        self.observations.append(observation)
        self.actions.append(action)
        self.rewards.append(reward)

    @property
    def length(self) -> int:
        return len(self.rewards)

    @property
    def total_reward(self) -> float:
        """The undiscounted return, summed in order like the existing script's."""
        return float(sum(self.rewards))

    def states(self) -> list[np.ndarray]:
        """Returns all T + 1 observations of an episode that is over, the final one included."""
        assert self.final_observation is not None
        return [*self.observations, self.final_observation]

    def state_dict(self) -> dict[str, Any]:
        """Returns an episode that is over as tensors and plain values, for a checkpoint."""
        return {
            "observations": torch.from_numpy(np.stack(self.states())),
            "actions": as_tensor(self.actions),
            "rewards": torch.tensor(self.rewards, dtype=torch.float64),
            "terminated": self.terminated,
        }

    @classmethod
    def from_state(cls, state: dict[str, Any]) -> "Episode":
        """Rebuilds an episode from what `state_dict` returned."""
        *observations, final = state["observations"].numpy()
        is_discrete = state["actions"].ndim == 1
        actions = state["actions"].tolist() if is_discrete else list(state["actions"].numpy())
        rewards = state["rewards"].tolist()
        return cls(observations, actions, rewards, final, bool(state["terminated"]))


def as_tensor(actions: list[Any]) -> torch.Tensor:
    """Stacks the actions of all steps: (T,) if discrete, (T, n) if continuous."""
    if actions and isinstance(actions[0], np.ndarray):
        return torch.from_numpy(np.stack(actions))
    return torch.tensor(actions)


def discounted_sums(terms: Sequence[float], factor: float) -> np.ndarray:
    """Computes S_t = x_t + factor S_t+1 for all terms x_t, (T,), float64: returns, if they are rewards."""
    backwards = accumulate(reversed(terms), lambda following, term: term + factor * following)
    return np.array([*backwards][::-1])


class Losses(NamedTuple):
    """The two losses of one update, computed before the weights change."""

    policy: float
    value: float


class TwoNetworks(ABC):
    """Base class: policy and value networks, an Adam for each, and a generator for the actions.

    They map observations (N, D) to probabilities (N, A) and to estimated returns (N, 1).
    """

    def __init__(self, policy: nn.Module, value: nn.Module, rates: tuple[float, float], seed: int) -> None:
        self.policy = policy
        self.value = value
        self.policy_optimizer = Adam(policy.parameters(), rates[0])
        self.value_optimizer = Adam(value.parameters(), rates[1])
        self.generator = np.random.default_rng(seed)

    @abstractmethod
    def sync(self) -> None:
        """Copies the policy's weights to where acting reads them."""

    def state_dict(self) -> dict[str, Any]:
        """Returns all that a bit-identical continuation needs, as tensors, numbers and strings."""
        return {
            "policy": self.policy.state_dict(),
            "value": self.value.state_dict(),
            "policy_optimizer": self.policy_optimizer.state_dict(),
            "value_optimizer": self.value_optimizer.state_dict(),
            "generator": generator_state(self.generator),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Loads what `state_dict` returned."""
        self.policy.load_state_dict(state["policy"])
        self.value.load_state_dict(state["value"])
        load_optimizer(self.policy_optimizer, state["policy_optimizer"])
        load_optimizer(self.value_optimizer, state["value_optimizer"])
        set_generator(self.generator, state["generator"])
        self.sync()


def check_finite(losses: Losses) -> None:
    """Raises WorkbenchError if a loss isn't finite; call it before any weight changes."""
    for name, loss in losses._asdict().items():
        if not math.isfinite(loss):
            raise WorkbenchError(f"the {name} loss is {loss}; the networks are unchanged")


def start_at_zero(layer: nn.Linear) -> None:
    """Sets a layer's weights and bias to 0, so that its output starts at 0."""
    nn.init.zeros_(layer.weight)
    nn.init.zeros_(layer.bias)


def descend(optimizer: torch.optim.Optimizer, loss: torch.Tensor) -> None:
    """Takes an optimizer step; raises WorkbenchError, weights unchanged, if the gradient isn't finite."""
    optimizer.zero_grad()
    loss.backward()
    gradients = [weight.grad for group in optimizer.param_groups for weight in group["params"]]
    if not math.isfinite(nn.utils.get_total_norm(gradients, math.inf)):
        raise WorkbenchError("a gradient isn't finite; the networks are unchanged")
    optimizer.step()
