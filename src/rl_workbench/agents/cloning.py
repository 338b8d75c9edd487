"""Behaviour cloning: a network that gives the action of a demonstrator for what was observed."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import nn

from rl_workbench.agents.greedy import ClippedAction, Scaling, SingleChoice, Spread
from rl_workbench.agents.normalisation import CLIP, SMALLEST
from rl_workbench.agents.policy_networks import Bounds
from rl_workbench.agents.settings import CloningSettings
from rl_workbench.states import generator_state, load_optimizer, set_generator

CHANNELS = 32  # of features of an image
SHARPNESS = 100.0  # of the softmax; at 1 it is nearly even over an image, and learns slowly


class CloneNetwork(nn.Module):
    """Maps observations (N, D), all parts side by side, to outputs (N, A).

    `shapes` are those of the parts: of images (height, width, channels) it sees where their features are.
    """

    def __init__(self, shapes: Sequence[tuple[int, ...]], outputs: int, hidden: Sequence[int]) -> None:
        super().__init__()
        self.shapes, self.sizes = list(shapes), [math.prod(shape) for shape in shapes]
        numbers = sum(size for size, shape in zip(self.sizes, shapes, strict=True) if len(shape) < 3)
        self.scaling = Scaling(np.zeros(numbers, np.float32), np.ones(numbers, np.float32), CLIP)
        self.images = nn.ModuleList(Places(shape[2]) for shape in shapes if len(shape) == 3)
        widths = [numbers + 3 * CHANNELS * len(self.images), *hidden]
        layers: list[nn.Module] = []
        for before, after in zip(widths, widths[1:], strict=False):
            layers += [nn.Linear(before, after), nn.ReLU()]
        self.head = nn.Sequential(*layers, nn.Linear(widths[-1], outputs))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        if not self.images:  # TorchScript takes no more
            return self.head(self.scaling(observations))
        numbers, seen, convolutions = [], [], iter(self.images)
        parts = observations.split(self.sizes, dim=1)
        for shape, part in zip(self.shapes, parts, strict=True):
            if len(shape) == 3:
                pictures = part.reshape(-1, *shape).permute(0, 3, 1, 2)
                seen.append(next(convolutions)(pictures / 127.5 - 1.0))
            else:
                numbers.append(part)
        plain = [self.scaling(torch.cat(numbers, 1))] if numbers else []
        return self.head(torch.cat([*plain, *seen], 1))


class Places(nn.Module):
    """Maps images (N, colours, H, W), from -1 to 1, to where features are in them, and how strong: (N, 96).

    A spatial softmax: a place is the mean over a softmax of its feature, from -1 to 1 along each side.
    """

    def __init__(self, colours: int) -> None:
        super().__init__()
        self.features = nn.Sequential(
            nn.Conv2d(colours, CHANNELS // 2, 5, stride=2, padding=2), nn.ReLU(),
            nn.Conv2d(CHANNELS // 2, CHANNELS, 3, stride=2, padding=1), nn.ReLU(),
            nn.Conv2d(CHANNELS, CHANNELS, 1),
        )  # fmt: skip

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        seen = self.features(images)
        shares = torch.softmax(SHARPNESS * seen.flatten(2), 2).reshape(seen.shape)
        down, across = (torch.linspace(-1.0, 1.0, side, device=seen.device) for side in seen.shape[2:])
        strengths = (shares * seen).sum((2, 3))
        return torch.cat([shares.sum(2) @ across, shares.sum(3) @ down, strengths], 1)


class CloningAgent:
    """Learns to act as the demonstrator. `actions` are bounds, or the number of a choice."""

    def __init__(
        self, settings: CloningSettings, shapes: Sequence[tuple[int, ...]], actions: Bounds | int,
        seed: int, device: str,
    ) -> None:  # fmt: skip
        self._actions, self._device, self._batch = actions, device, settings.batch_size
        outputs = actions if isinstance(actions, int) else actions.low.size
        self.network = CloneNetwork(shapes, outputs, settings.hidden_sizes).to(device)
        self._greedy: nn.Module = (
            SingleChoice(self.network)
            if isinstance(actions, int)
            else ClippedAction(
                nn.Sequential(self.network, Spread(actions.middle, actions.half)), actions.low, actions.high
            )
        ).to(device)
        self._optimizer = torch.optim.AdamW(
            self.network.parameters(), settings.learning_rate, weight_decay=settings.weight_decay
        )
        self._generator = np.random.default_rng(seed)
        self.steps = 0

    def begin(self, observations: np.ndarray, actions: np.ndarray) -> None:
        """Takes what to learn from: observations (N, D), float32, and the actions (N, ...) chosen there."""
        self._observations = torch.from_numpy(observations).to(self._device)
        targets = actions
        if isinstance(self._actions, Bounds):
            spread = (actions.reshape(len(actions), -1) - self._actions.middle) / self._actions.half
            targets = spread.astype(np.float32)
        self._targets = torch.from_numpy(targets).to(self._device)
        sizes, shapes = self.network.sizes, self.network.shapes
        ends = np.cumsum(sizes)
        plain = [observations[:, end - size : end]
                 for size, end, shape in zip(sizes, ends, shapes, strict=True) if len(shape) < 3]  # fmt: skip
        if plain:
            numbers = np.concatenate(plain, 1, dtype=np.float64)
            factors = 1.0 / np.sqrt(numbers.var(0) + SMALLEST)
            self.network.scaling.offset.copy_(torch.from_numpy(numbers.mean(0)))
            self.network.scaling.factors.copy_(torch.from_numpy(factors))

    def learn(self) -> float:
        """Takes a gradient step by a minibatch; returns its loss."""
        chosen = self._generator.integers(len(self._observations), size=self._batch)
        index = torch.from_numpy(chosen).to(self._device)
        outputs, targets = self.network(self._observations[index]), self._targets[index]
        lost = nn.functional.cross_entropy if isinstance(self._actions, int) else nn.functional.l1_loss
        loss = lost(outputs, targets)
        self._optimizer.zero_grad()
        loss.backward()
        self._optimizer.step()
        self.steps += 1
        return float(loss.detach())

    @torch.no_grad()
    def act_greedily(self, observation: np.ndarray) -> Any:
        """Returns the action for an observation (D,), float32."""
        action = self._greedy(torch.from_numpy(observation)[None].to(self._device))[0].cpu()
        return int(action) if isinstance(self._actions, int) else action.numpy()

    def greedy_network(self) -> nn.Module | None:
        """Returns what maps observations (N, D) to actions; None for images."""
        return None if self.network.images else self._greedy

    def state_dict(self) -> dict[str, Any]:
        """Returns network, optimizer, generator and steps."""
        return {
            "network": self.network.state_dict(), "optimizer": self._optimizer.state_dict(),
            "generator": generator_state(self._generator), "steps": self.steps,
        }  # fmt: skip

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Loads what `state_dict` returned."""
        self.network.load_state_dict(state["network"])
        load_optimizer(self._optimizer, state["optimizer"])
        set_generator(self._generator, state["generator"])
        self.steps = int(state["steps"])
