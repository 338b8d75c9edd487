"""The DQN agent: acting, replay, learning. It knows neither environments nor files."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from rl_workbench.agents.adam import Adam
from rl_workbench.agents.greedy import SingleChoice
from rl_workbench.agents.normalisation import Normaliser
from rl_workbench.agents.replay import Batch, NStepReturns, ReplayBuffer
from rl_workbench.agents.settings import DQNSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.states import generator_state, load_optimizer, set_generator


class Learned(NamedTuple):
    """Loss and mean Q-value of the last gradient step in a round."""

    td_loss: float
    q_values: float


class DQNAgent:
    """Learns a Q-network from single steps.

    It has its own generators for initial weights, exploration and batches: the same seed and the same steps
    give bit-identical weights. Observations are float32 of shape (observation_size,), actions 0 to `actions`
    - 1.
    """

    def __init__(
        self, settings: DQNSettings, observation_size: int, actions: int, seed: int = 0, device: str = "cpu"
    ) -> None:
        self.settings = settings
        self.observation_size, self.actions = observation_size, actions
        self._device = torch.device(device)
        self.q_net = self._network(observation_size, seed)
        self.target_net = self._network(observation_size, seed).requires_grad_(False).eval()
        self._flat, self._target = FlatParameters(self.q_net), FlatParameters(self.target_net)
        self._optimizer = Adam([self._flat.vector], settings.learning_rate, fused=True)
        self._loss = nn.functional.mse_loss if settings.loss == "mse" else nn.functional.huber_loss
        self.buffer = ReplayBuffer(settings.buffer_size, observation_size)
        self.normaliser = Normaliser(observation_size) if settings.normalize_observations else None
        self._returns = NStepReturns(settings.n_step, settings.gamma)
        self._epsilon = Epsilon(settings)
        self._explore, self._draw = (np.random.default_rng([seed, use]) for use in (0, 1))
        self._before_action = self._explore.bit_generator.state
        self._values: Callable[[np.ndarray], np.ndarray] = fast_values(self.q_net)
        if self._device.type != "cpu":
            self._values = lambda observation: self.q_values(observation[None])[0]
        self.steps = 0  # environment steps
        self.gradient_steps = 0

    def _network(self, observation_size: int, seed: int) -> nn.Module:
        kind = DuelingQNetwork if self.settings.dueling else QNetwork
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            network = kind(observation_size, self.actions, self.settings.hidden_sizes)
        return network.to(self._device)

    @property
    def epsilon(self) -> float:
        """The probability that the next action is random."""
        return self._epsilon.value

    def act(self, observation: np.ndarray) -> int:
        """Returns a random action with probability epsilon, else the greedy one."""
        self._before_action = self._explore.bit_generator.state
        if self._explore.random() < self._epsilon.value:
            return int(self._explore.integers(self.actions))
        return self.act_greedily(observation)

    def take_back_action(self) -> None:
        """Undoes the draws of the last `act`, whose action wasn't carried out."""
        self._explore.bit_generator.state = self._before_action

    def act_greedily(self, observation: np.ndarray) -> int:
        """Returns the action with the highest Q-value."""
        if self.normaliser is not None:
            observation = self.normaliser(observation)
        return int(self._values(observation).argmax())

    def greedy_network(self) -> SingleChoice:
        """Returns the greedy policy as a torch module: observations (N, D) to actions (N,)."""
        if self.normaliser is None:
            return SingleChoice(self.q_net)
        return SingleChoice(nn.Sequential(self.normaliser.network(), self.q_net))

    @torch.no_grad()
    def q_values(self, observations: np.ndarray) -> np.ndarray:
        """Returns the Q-value of each action (N, A) for observations (N, D)."""
        values: np.ndarray = self.q_net(self._inputs(observations)).cpu().numpy()
        return values

    def _inputs(self, observations: np.ndarray) -> torch.Tensor:
        if self.normaliser is not None:
            observations = self.normaliser(observations)
        return torch.from_numpy(observations).to(self._device)

    def observe(
        self, step: tuple[np.ndarray, int, float], following: np.ndarray, terminated: bool, truncated: bool
    ) -> None:
        """Stores one step: (observation, action, reward), and what followed."""
        observation, action, reward = step
        if self.normaliser is not None:
            self.normaliser.add(observation)
        scaled = (observation, action, reward * self.settings.reward_scale)
        ended = terminated or truncated
        valued = not (terminated if self.settings.bootstrap_truncated else ended)
        for transition in self._returns.add(scaled, following, ended, valued):
            self.buffer.push(transition)
        self.steps += 1
        self._epsilon.step_done(self.steps)

    def episode_done(self) -> None:
        """Ends the current episode, whether it finished or is abandoned."""
        self._returns.clear()
        self._epsilon.ended("episode")

    @property
    def is_due(self) -> bool:
        """Whether a round of learning is due after this step."""
        settings = self.settings
        return (
            self.steps >= settings.learning_starts
            and self.steps % settings.train_frequency == 0
            and len(self.buffer) >= min(settings.batch_size, settings.buffer_size)
        )

    def learn(self) -> Learned:
        """Runs one round of `settings.gradient_steps` gradient steps.

        Raises WorkbenchError if loss or gradient isn't finite; that gradient step changes no weight.
        """
        settings = self.settings
        self._optimizer.param_groups[0]["lr"] = learning_rate(settings, self.steps)
        batch = self.buffer.sample(settings.batch_size, self._draw, settings.gradient_steps)
        for index in range(settings.gradient_steps):
            learned = self._gradient_step(self._tensors(batch, index))
        self._epsilon.ended("step")
        return learned

    def _tensors(self, batch: Batch, index: int) -> tuple[torch.Tensor, ...]:
        return (
            self._inputs(batch.observations[index]),
            *(torch.from_numpy(column[index]).to(self._device) for column in batch[1:3]),
            self._inputs(batch.next_observations[index]),
            torch.from_numpy(batch.discounts[index]).to(self._device),
        )

    def _gradient_step(self, tensors: tuple[torch.Tensor, ...]) -> Learned:
        observations, actions, rewards, following, discounts = tensors
        chosen = self.q_net(observations).gather(1, actions.unsqueeze(1)).squeeze(1)
        loss = self._loss(chosen, rewards + discounts * self._next_values(following))
        learned = Learned(loss.item(), chosen.detach().mean().item())
        self._flat.gradient.zero_()
        loss.backward()
        self._clip(learned.td_loss)
        self._optimizer.step()
        self.gradient_steps += 1
        if self.gradient_steps % self.settings.target_network_frequency == 0:
            self._target.follow(self._flat, self.settings.tau)
        return learned

    @torch.no_grad()
    def _next_values(self, following: torch.Tensor) -> torch.Tensor:
        rated = self.target_net(following)
        if not self.settings.double:
            return rated.max(1).values
        best = self.q_net(following).argmax(1, keepdim=True)
        return rated.gather(1, best).squeeze(1)

    def _clip(self, loss: float) -> None:
        """Clips the gradient's norm; raises WorkbenchError if loss or gradient isn't finite."""
        norm = self._flat.gradient.norm().item()
        if not (math.isfinite(loss) and math.isfinite(norm)):
            raise WorkbenchError(
                f"the loss is {loss} and the gradient's norm {norm} at step {self.steps}; the "
                "networks are unchanged; try a smaller learning_rate or reward_scale"
            )
        if 0 < self.settings.max_grad_norm < norm:
            self._flat.gradient.mul_(self.settings.max_grad_norm / norm)

    def policy_state(self) -> dict[str, Any]:
        """Returns what acting needs: `q_net`, `target_net`, `epsilon`, and `normaliser` (or None)."""
        return {
            "q_net": _copied(self.q_net),
            "target_net": _copied(self.target_net),
            "epsilon": self._epsilon.value,
            "normaliser": self.normaliser.state_dict() if self.normaliser else None,
        }

    def load_policy_state(self, state: dict[str, Any]) -> None:
        """Loads what `policy_state` returned; a file of the DQN tutorial has no normaliser."""
        self.q_net.load_state_dict(state["q_net"])
        self.target_net.load_state_dict(state["target_net"])
        self._epsilon.value = float(state["epsilon"])
        if self.normaliser is not None:
            self.normaliser.load_state_dict(state["normaliser"])

    def state_dict(self) -> dict[str, Any]:
        """Returns everything that the next step depends on, as tensors, numbers and strings.

        Optimiser and replay buffer are not copied: write or copy the result before the next step.
        """
        return {
            **self.policy_state(),
            "optimizer": self._optimizer.state_dict(),
            "replay": self.buffer.state_dict(),
            "window": self._returns.state_dict(),
            "generators": [generator_state(self._explore), generator_state(self._draw)],
            "steps": self.steps,
            "gradient_steps": self.gradient_steps,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Loads what `state_dict` returned."""
        self.load_policy_state(state)
        load_optimizer(self._optimizer, state["optimizer"])
        self.buffer.load_state_dict(state["replay"])
        self._returns.load_state_dict(state["window"])
        for generator, text in zip((self._explore, self._draw), state["generators"], strict=True):
            set_generator(generator, text)
        self.steps, self.gradient_steps = int(state["steps"]), int(state["gradient_steps"])


def _copied(network: nn.Module) -> dict[str, torch.Tensor]:
    """Clones the state_dict, since the parameters are views of one vector."""
    return {name: tensor.detach().cpu().clone() for name, tensor in network.state_dict().items()}


def _hidden(sizes: Sequence[int]) -> list[nn.Module]:
    layers: list[nn.Module] = []
    for inputs, outputs in zip(sizes, sizes[1:], strict=False):
        layers += [nn.Linear(inputs, outputs), nn.ReLU()]
    return layers


class QNetwork(nn.Module):
    """Maps observations (N, D) to the value of each action (N, A)."""

    def __init__(self, observation_size: int, actions: int, hidden: Sequence[int]) -> None:
        super().__init__()
        layers = _hidden([observation_size, *hidden])
        self.net = nn.Sequential(*layers, nn.Linear(hidden[-1], actions))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        values: torch.Tensor = self.net(observations)
        return values


class DuelingQNetwork(nn.Module):
    """A QNetwork of the state's value and each action's advantage: Q = V + A - mean(A)."""

    def __init__(self, observation_size: int, actions: int, hidden: Sequence[int]) -> None:
        super().__init__()
        self.feature = nn.Sequential(*_hidden([observation_size, *hidden]))
        self.value = nn.Linear(hidden[-1], 1)
        self.advantage = nn.Linear(hidden[-1], actions)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        features = self.feature(observations)
        advantage = self.advantage(features)
        values: torch.Tensor = self.value(features) + advantage
        return values - advantage.mean(dim=1, keepdim=True)


def fast_values(network: nn.Module) -> Callable[[np.ndarray], np.ndarray]:
    """Returns the network as a NumPy function of one observation (D,), several times as fast as torch.

    It reads the network's own memory, so it follows every change of the weights. Its results (A,) rank
    actions as the Q-values do; for a dueling network they lack V - mean(A).
    """
    layers = list(network.modules())
    if isinstance(network, DuelingQNetwork):
        layers.remove(network.value)
    linear = [layer for layer in layers if isinstance(layer, nn.Linear)]
    pairs = [(layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in linear]
    *hidden, (weight, bias) = pairs

    def values(observation: np.ndarray) -> np.ndarray:
        for matrix, offset in hidden:
            observation = matrix @ observation
            observation += offset
            np.maximum(observation, 0.0, out=observation)
        result: np.ndarray = weight @ observation
        result += bias
        return result

    return values


class FlatParameters:
    """Moves a network's parameters into one vector, and their gradients into another.

    The network computes the same. But optimiser, gradient clipping and target update handle one tensor
    instead of one per parameter, which halves the time of a small network's gradient step.
    """

    def __init__(self, network: nn.Module) -> None:
        parameters = list(network.parameters())
        vector = torch.cat([parameter.detach().reshape(-1) for parameter in parameters])
        self.vector = nn.Parameter(vector)
        self.gradient = torch.zeros_like(vector)
        self.vector.grad = self.gradient
        start = 0
        for parameter in parameters:
            piece = slice(start, start + parameter.numel())
            parameter.data = vector[piece].view_as(parameter)
            parameter.grad = self.gradient[piece].view_as(parameter)
            start = piece.stop

    @torch.no_grad()
    def follow(self, other: "FlatParameters", share: float) -> None:
        """Moves the weights towards another network's by a share of the distance; 1 copies them."""
        if share == 1.0:
            self.vector.copy_(other.vector)
        else:
            self.vector.lerp_(other.vector, share)


class Epsilon:
    """The probability of a random action.

    - linear: from start_e to end_e over exploration_fraction of total_timesteps
    - step: times epsilon_decay after each round of learning, as in the DQN tutorial's code
    - episode: times epsilon_decay after each episode, as in the DQN tutorial's table
    """

    def __init__(self, settings: DQNSettings) -> None:
        self._settings = settings
        self._duration = settings.exploration_fraction * settings.total_timesteps
        self.value = settings.start_e

    def step_done(self, steps: int) -> None:
        """Updates the linear schedule to the number of environment steps so far."""
        if self._settings.epsilon_schedule == "linear":
            start, end = self._settings.start_e, self._settings.end_e
            share = min(1.0, steps / self._duration) if self._duration else 1.0
            self.value = start + (end - start) * share

    def ended(self, what: str) -> None:
        """Applies the decay of a round of learning, "step", or of an "episode"."""
        if self._settings.epsilon_schedule == what:
            self.value = max(self._settings.end_e, self.value * self._settings.epsilon_decay)


def learning_rate(settings: DQNSettings, steps: int) -> float:
    """Returns the learning rate after that many environment steps."""
    if settings.lr_schedule == "constant":
        return settings.learning_rate
    return settings.learning_rate * max(0.0, 1.0 - steps / settings.total_timesteps)
