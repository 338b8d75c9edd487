"""Policy gradient with a value baseline: a linear softmax policy, one update per episode.

This is the existing script's algorithm. The advantage of a step is its discounted return less the value
network's estimate before the update. The policy's loss is the sum, not the mean, of -log pi(a|s) A; the
value's loss is the mean squared error to the returns.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from rl_workbench.agents.greedy import SingleChoice
from rl_workbench.agents.settings import DocumentSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.states import generator_state, load_optimizer, set_generator


class PolicyNetwork(nn.Module):
    """Maps observations (N, 4) to the probabilities of the two actions (N, 2)."""

    def __init__(self) -> None:
        super().__init__()
        self.fc = nn.Linear(4, 2)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return torch.softmax(self.fc(observations), dim=1)


class ValueNetwork(nn.Module):
    """Maps observations (N, 4) to the estimated return (N, 1)."""

    def __init__(self) -> None:
        super().__init__()
        self.fc1 = nn.Linear(4, 10)
        self.relu = nn.ReLU()
        self.fc2 = nn.Linear(10, 1)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.fc2(self.relu(self.fc1(observations)))


@dataclass
class Episode:
    """One episode, step by step: the observation before the action, the action, the reward."""

    observations: list[np.ndarray] = field(default_factory=list)  # each float32 (D,)
    actions: list[Any] = field(default_factory=list)  # indices, or arrays (n,), float32
    rewards: list[float] = field(default_factory=list)
    final_observation: np.ndarray | None = None  # after the last step
    terminated: bool = False  # by the task; False: it was cut off
    success: bool | None = None  # None if the environment doesn't say
    curves: dict[str, float] = field(default_factory=dict)  # by tag: what the environment tells

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


class Losses(NamedTuple):
    """The two losses of one update, computed before the weights change."""

    policy: float
    value: float


def discounted_returns(rewards: list[float], gamma: float) -> np.ndarray:
    """Computes each step's return backwards from the last: G_t = r_t + gamma G_t+1.

    Returns:
        float64, shape (len(rewards),).
    """
    returns = np.empty(len(rewards))
    future = 0.0
    for index in range(len(rewards) - 1, -1, -1):
        future = rewards[index] + gamma * future
        returns[index] = future
    return returns


class TwoNetworks(ABC):
    """Base class: a policy and a value network, an Adam for each, and a generator for the actions.

    Args:
        policy: maps observations (N, D) to probabilities (N, A).
        value: maps observations (N, D) to estimated returns (N, 1).
        rates: learning rates of policy and value.
        seed: seeds the generator.
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


class PolicyGradientAgent(TwoNetworks):
    """Learns from whole episodes; acts from a NumPy copy of the linear policy.

    Both output layers start at zero: a uniform policy, and a value of 0 everywhere. With random output
    layers, as in the existing script, several seeds in ten need more than 600 episodes: a policy weight
    of the wrong sign has to be unlearned, and a hidden unit with a negative weight to the value's output
    soon dies, since returns are positive.

    Args:
        seed: seeds the agent's own generators, for the initial weights and for the actions.
        settings: the algorithm's options.
    """

    def __init__(self, seed: int = 0, settings: DocumentSettings | None = None) -> None:
        self.settings = settings = settings or DocumentSettings()
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            policy, value = PolicyNetwork(), ValueNetwork()
        if not settings.random_weights:
            start_at_zero(policy.fc)
            start_at_zero(value.fc2)
        rates = (settings.policy_learning_rate, settings.value_learning_rate)
        super().__init__(policy, value, rates, seed)
        self._output = policy.fc
        self.sync()

    def sync(self) -> None:
        """Copies the policy's weights to where acting reads them."""
        self._weight = self._output.weight.detach().numpy().copy()  # (2, 4)
        self._bias = self._output.bias.detach().numpy().copy()  # (2,)

    def probability_of_zero(self, observation: np.ndarray) -> float:
        """Returns the policy's probability of action 0 for an observation (4,).

        NumPy is eight times as fast as torch here, and equal within float32 rounding.
        """
        left, right = (self._weight @ observation + self._bias).tolist()
        return 1.0 / (1.0 + math.exp(min(right - left, 700.0)))

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> int:
        """Draws an action from the policy with the given generator."""
        return 0 if generator.random() < self.probability_of_zero(observation) else 1

    def limited(self, action: int) -> int:
        """Returns a drawn action in the form that the environment takes; here it is the same."""
        return action

    def act_greedily(self, observation: np.ndarray) -> int:
        """Returns the more probable action."""
        return 0 if self.probability_of_zero(observation) >= 0.5 else 1

    def greedy_network(self) -> SingleChoice:
        """Returns the greedy policy as a torch module: observations (N, 4) to actions (N,)."""
        return SingleChoice(self._output)

    def learn(self, episode: Episode) -> Losses:
        """Updates both networks once from one episode.

        Raises:
            WorkbenchError: if a loss or the policy's gradient isn't finite, before any weight changes; or if
                the value's gradient isn't.
        """
        observations = torch.from_numpy(np.stack(episode.observations))  # (T, 4)
        actions = torch.tensor(episode.actions)  # (T,)
        returns = torch.from_numpy(
            discounted_returns(episode.rewards, self.settings.gamma)
        )  # (T,) float64
        values = self.value(observations).squeeze(1)  # (T,)
        advantages = (returns - values.detach().double()).float()
        value_loss = nn.functional.mse_loss(values, returns.float())
        chosen = self.policy(observations).gather(1, actions.unsqueeze(1)).squeeze(1)
        policy_loss = -torch.sum(torch.log(chosen) * advantages)
        losses = Losses(policy_loss.item(), value_loss.item())
        check_finite(losses)
        descend(self.policy_optimizer, policy_loss)
        descend(self.value_optimizer, value_loss)
        self.sync()
        return losses


def check_finite(losses: Losses) -> None:
    """Raises WorkbenchError if a loss isn't finite; call it before any weight changes."""
    for name, loss in losses._asdict().items():
        if not math.isfinite(loss):
            raise WorkbenchError(f"the {name} loss is {loss}; the networks were left unchanged")


def start_at_zero(layer: nn.Linear) -> None:
    """Sets a layer's weights and bias to 0, so that its output starts at 0."""
    nn.init.zeros_(layer.weight)
    nn.init.zeros_(layer.bias)


def descend(optimizer: torch.optim.Optimizer, loss: torch.Tensor) -> None:
    """Takes one optimizer step down the loss.

    Raises:
        WorkbenchError: if the gradient isn't finite, which is possible even with a finite loss. The
            weights are unchanged.
    """
    optimizer.zero_grad()
    loss.backward()
    gradients = [weight.grad for group in optimizer.param_groups for weight in group["params"]]
    if not math.isfinite(nn.utils.get_total_norm(gradients, math.inf)):
        raise WorkbenchError("a gradient isn't finite; the networks were left unchanged")
    optimizer.step()
