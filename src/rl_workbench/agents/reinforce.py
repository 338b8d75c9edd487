"""REINFORCE with a learned baseline: generalised advantages, one policy step per batch of episodes.

It differs from the policy-gradient document's algorithm (document.py) in four ways, each of which
reduces the gradient's variance. Advantages are weighted sums of temporal differences (Schulman et al. 2016,
λ = 0.95) instead of whole returns; they are normalised over the batch; the baseline takes many steps per
batch, not one; and observations are scaled, so that one learning rate suits all weights. A truncated episode
bootstraps from the baseline, a terminated one doesn't.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import nn

from rl_workbench.agents.greedy import ClippedAction, Scaling, SingleChoice, Spread
from rl_workbench.agents.normalisation import Normaliser
from rl_workbench.agents.policy_gradient import (
    Episode,
    Losses,
    TwoNetworks,
    as_tensor,
    check_finite,
    descend,
    discounted_sums,
    start_at_zero,
)
from rl_workbench.agents.policy_networks import (
    Actor,
    Bounds,
    GaussianActor,
    GaussianNetwork,
    PairActor,
    SoftmaxActor,
    SoftmaxNetwork,
)
from rl_workbench.agents.settings import ReinforceSettings

SMALLEST_SPREAD = 1e-8  # added to the advantages' deviation, so that equal ones stay 0


class BaselineNetwork(nn.Module):
    """Maps prepared observations (N, D) to the estimated return (N, 1)."""

    def __init__(self, observations: int, hidden: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Linear(observations, hidden), nn.Tanh(),
            nn.Linear(hidden, hidden), nn.Tanh(),
            nn.Linear(hidden, 1),
        )  # fmt: skip

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.layers(observations)


class ReinforceAgent(TwoNetworks):
    """Learns from batches of whole episodes, with a softmax policy or, for continuous actions, a Gaussian.

    `scale` (D,) divides observations. `actions` are their number, or the bounds of continuous ones. Each of
    the `environments` that play at the same time contributes equally to a batch.
    """

    def __init__(
        self,
        seed: int = 0,
        scale: Sequence[float] = (1.0, 1.0, 1.0, 1.0),
        settings: ReinforceSettings | None = None,
        actions: int | Bounds = 2,
        environments: int = 1,
    ) -> None:
        self.settings = settings = settings or ReinforceSettings()
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            size, hidden = len(scale), settings.policy_hidden
            self._network: SoftmaxNetwork | GaussianNetwork
            if isinstance(actions, int):
                self._network = SoftmaxNetwork(size, actions, hidden)
            else:
                self._network = GaussianNetwork(size, actions, hidden, settings.log_std_init)
            value = BaselineNetwork(size, settings.value_hidden)
        start_at_zero(self._network.fc)
        rates = (settings.policy_learning_rate, settings.value_learning_rate)
        super().__init__(self._network, value, rates, seed)
        self._factors = 1.0 / np.asarray(scale, np.float32)  # (D,)
        self._normaliser = Normaliser(size) if settings.normalize_observations else None
        self._actions = actions
        self._batch_size = settings.batch_episodes * environments
        self._batch: list[Episode] = []
        self._actor: Actor
        self.sync()

    def sync(self) -> None:
        """Copies the policy's weights into the actor."""
        self._actor = self._make_actor()

    def _make_actor(self) -> Actor:
        network = self._network
        if isinstance(self._actions, Bounds):
            assert isinstance(network, GaussianNetwork)
            return GaussianActor(network, self._actions, self._prepared)
        assert isinstance(network, SoftmaxNetwork)
        if self._actions == 2 and not network.has_hidden and self._normaliser is None:
            return PairActor(network, self._factors)
        return SoftmaxActor(network, self._prepared)

    def _prepared(self, observations: np.ndarray) -> np.ndarray:
        """Scales and normalises observations (..., D) for the networks, float32."""
        scaled: np.ndarray = observations * self._factors
        return scaled if self._normaliser is None else self._normaliser(scaled)

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> Any:
        """Draws an action to learn from; pass it through `limited` for the environment."""
        return self._actor.draw(observation, generator)

    def limited(self, action: Any) -> Any:
        """Returns a drawn action in the form that the environment takes, within its bounds."""
        return self._actions.limited(action) if isinstance(self._actions, Bounds) else action

    def act_greedily(self, observation: np.ndarray) -> Any:
        """Returns the most probable action."""
        return self._actor.greedy(observation)

    def greedy_network(self) -> nn.Module:
        """Returns the greedy policy as a torch module: observations (N, D) to actions (N, ...)."""
        scaling = Scaling(np.zeros_like(self._factors), self._factors)
        normaliser = [] if self._normaliser is None else [self._normaliser.network()]
        outputs = nn.Sequential(scaling, *normaliser, *self._network.layers())
        bounds = self._actions
        if not isinstance(bounds, Bounds):
            return SingleChoice(outputs)
        spread = Spread(bounds.middle, bounds.half)
        return ClippedAction(nn.Sequential(outputs, spread), bounds.low, bounds.high)

    def learn(self, *episodes: Episode) -> Losses | None:
        """Adds an episode, or one per environment, to the batch; a full batch updates both networks.

        Returns the losses before the update; None if the batch isn't full yet. Raises WorkbenchError if a
        loss or a gradient isn't finite; the network that it belongs to is as before then.
        """
        batch = [*self._batch, *episodes]
        if len(batch) < self._batch_size:
            self._batch = batch
            return None
        losses = self._update(batch)
        self._batch = []
        self._measure(batch)
        self.sync()
        return losses

    def _measure(self, batch: list[Episode]) -> None:
        """Updates the normaliser, after the networks: their update must see observations as acting did."""
        if self._normaliser is not None:
            for episode in batch:
                for observation in episode.observations:
                    self._normaliser.add(observation * self._factors)

    def _update(self, batch: list[Episode]) -> Losses:
        observations = torch.cat([self._seen(episode.observations) for episode in batch])
        actions = as_tensor([action for episode in batch for action in episode.actions])
        advantages, targets = self._advantages(batch)
        spread = float(advantages.std(correction=0))
        advantages = (advantages - advantages.mean()) / (spread + SMALLEST_SPREAD)
        policy_loss = self._policy_loss(observations, actions, advantages)
        value_loss = self._value_loss(observations, targets)
        losses = Losses(policy_loss.item(), value_loss.item())
        check_finite(losses)
        descend(self.policy_optimizer, policy_loss)
        for _ in range(self.settings.value_epochs):
            descend(self.value_optimizer, self._value_loss(observations, targets))
        return losses

    def _policy_loss(
        self, observations: torch.Tensor, actions: torch.Tensor, advantages: torch.Tensor
    ) -> torch.Tensor:
        output = self._network(observations)
        loss = -(self._network.log_chances(output, actions) * advantages).mean()
        if not self.settings.entropy_coefficient:
            return loss
        return loss - self.settings.entropy_coefficient * self._network.entropy(output)

    def _advantages(self, batch: list[Episode]) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns advantages and the baseline's targets, each (T,) over all episodes' steps."""
        advantages, targets = [], []
        for episode in batch:
            values = self._values(episode)
            gains = generalised_advantages(
                episode.rewards, values, self.settings.gamma, self.settings.gae_lambda
            )
            advantages.append(gains)
            targets.append(gains + values[:-1])
        return tuple(  # type: ignore[return-value]
            torch.from_numpy(np.concatenate(each).astype(np.float32)) for each in (advantages, targets)
        )

    def _values(self, episode: Episode) -> np.ndarray:
        """Returns the baseline at each state, (T + 1,); 0 at the last one if the episode terminated."""
        with torch.no_grad():
            values = self.value(self._seen(episode.states())).squeeze(1).double().numpy()
        if episode.terminated:
            values[-1] = 0.0
        return values

    def _seen(self, observations: Sequence[np.ndarray]) -> torch.Tensor:
        return torch.from_numpy(self._prepared(np.stack(observations)))

    def _value_loss(self, observations: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
        return nn.functional.mse_loss(self.value(observations).squeeze(1), targets)

    def state_dict(self) -> dict[str, Any]:
        """Returns the base class's state with the normaliser and the episodes of an unfinished batch."""
        return {
            **super().state_dict(),
            "batch": [episode.state_dict() for episode in self._batch],
            "normaliser": None if self._normaliser is None else self._normaliser.state_dict(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Loads what `state_dict` returned."""
        self._batch = [Episode.from_state(each) for each in state["batch"]]
        if self._normaliser is not None:
            self._normaliser.load_state_dict(state["normaliser"])
        super().load_state_dict(state)


def generalised_advantages(
    rewards: Sequence[float], values: np.ndarray, gamma: float, gae_lambda: float
) -> np.ndarray:
    """Computes Â_t = Σ_k (γλ)^k δ_{t+k}, δ_t = r_t + γ V(s_{t+1}) - V(s_t) (Schulman et al. 2016, eq. 16).

    Returns (T,), float64, for rewards (T,) and the values of T states and the final one, (T + 1,).
    """
    differences = np.asarray(rewards) + gamma * values[1:] - values[:-1]
    return discounted_sums(differences.tolist(), gamma * gae_lambda)
