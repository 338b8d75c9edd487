"""A run's policy for one file that torch runs alone, held against the policy itself."""

import copy
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium import spaces
from torch import nn

from rl_workbench.agents.greedy import Choice
from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.runs.episodes import TEST_SEED
from rl_workbench.tools.runs.exported import (
    FORMAT,
    Observation,
    batch,
    described,
    read,
    written,
)
from rl_workbench.tools.runs.policies import LearnedPolicy
from rl_workbench.tools.runs.runs import Run
from rl_workbench.training.environments import as_float32
from rl_workbench.training.folder import LIBRARIES, versions

TRIED = 1000  # observations
ROUNDING = 1e-4  # what another order of the same sums makes at most, in single precision


class Agreement(NamedTuple):
    """How a file compares with its policy."""

    observations: int
    equal: int  # of them: the same action, to the last bit
    largest_difference: float  # of continuous actions, as a share of the distance of their bounds


class OfVectors(nn.Module):
    """Observations (N, D), of any number type, to greedy actions (N, ...)."""

    def __init__(self, network: nn.Module) -> None:
        super().__init__()
        self.network = network

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.network(self.joined(observations))

    def joined(self, observations: torch.Tensor) -> torch.Tensor:
        """What the network takes."""
        return observations.float()


class OfDicts(nn.Module):
    """Observations as a dict of (N, ...), of any number type, to greedy actions (N, ...).

    Args:
        network: takes them side by side.
        names: of the dict, in the network's order.
    """

    def __init__(self, network: nn.Module, names: Sequence[str]) -> None:
        super().__init__()
        self.network, self.names = network, list(names)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        return self.network(self.joined(observations))

    def joined(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """What the network takes."""
        parts = [observations[name].float().flatten(1) for name in self.names]
        return torch.cat(parts, dim=1)


def export(run: Run, policy: LearnedPolicy, seed: int) -> tuple[bytes, Agreement]:
    """The content of the file, and how it compares with the policy.

    Args:
        run: that the policy is of.
        policy: its environment is stepped.
        seed: of the observations that the file is tried with.

    Raises:
        WorkbenchError: if the environment fails, what it observes can't be exported, or the file
            would act otherwise than the policy.
    """
    space, original = policy.env.observation_space, policy.env.unwrapped.observation_space
    module = _module(policy.network, space, run.env_id)
    # Read back: it is the file's content that is tried.
    agreement = _compared(read(written(module, {}))[0], module, policy, _observations(policy, seed))
    metadata = {
        "format": FORMAT,
        "env_id": run.env_id,
        "env_kwargs": run.env_kwargs,
        "algorithm": run.algorithm,
        "experiment": run.experiment,
        "seed": run.seed,
        "checkpoint": policy.checkpoint.name,
        "steps": policy.steps,
        "observation_space": described(space),
        "flattened_from": None if original == space else described(original),
        "action_space": described(policy.env.action_space),
        "agreement": agreement._asdict(),
        "versions": {name: each for name, each in versions().items() if name in LIBRARIES},
    }
    return written(module, metadata), agreement


def _module(network: nn.Module, space: spaces.Space[Any], env_id: str) -> OfVectors | OfDicts:
    own = copy.deepcopy(network).cpu().eval().requires_grad_(False)
    for layer in own.modules():
        if isinstance(
            layer, nn.Linear
        ):  # TorchScript knows no integers of NumPy's, which spaces have
            layer.in_features, layer.out_features = int(layer.in_features), int(layer.out_features)
    if not isinstance(space, spaces.Dict):
        return OfVectors(own)
    for name, part in space.items():
        if not isinstance(part, spaces.Box) or not np.issubdtype(part.dtype, np.floating):
            raise WorkbenchError(
                f"a policy of {env_id} can't be exported: the part {name} of its observations is {part}"
            )
    return OfDicts(own, list(space))


def _observations(policy: LearnedPolicy, seed: int) -> list[Observation]:
    """Half of them met in episodes that act greedily and by chance in turn; half far around those."""
    env = policy.env
    env.action_space.seed(seed)
    met: list[Observation] = []
    observation, _ = env.reset(seed=TEST_SEED + seed)
    while len(met) < TRIED // 2:
        met.append(as_float32(observation))
        action = policy.act(met[-1]) if len(met) % 2 else env.action_space.sample()
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            observation, _ = env.reset()
    return met + _scattered(met, np.random.default_rng(seed))


def _scattered(met: list[Observation], generator: np.random.Generator) -> list[Observation]:
    if isinstance(met[0], dict):
        parts = [_scattered([each[name] for each in met], generator) for name in met[0]]
        return [dict(zip(met[0], each, strict=True)) for each in zip(*parts, strict=True)]
    vectors = np.stack(met)
    spread = 3.0 * vectors.std(axis=0) + 0.1
    return list((vectors + spread * generator.normal(size=vectors.shape)).astype(np.float32))


def _compared(
    file: torch.jit.ScriptModule,
    module: OfVectors | OfDicts,
    policy: LearnedPolicy,
    observations: list[Observation],
) -> Agreement:
    """What the file does with all observations at once, and one by one, beside what the policy does.

    Raises:
        WorkbenchError: if it is something else, by more than rounding.
    """
    wanted = np.stack([np.asarray(policy.act(each)) for each in observations])
    with torch.no_grad():
        together = file(batch(observations)).numpy()
        singly = torch.cat([file(batch([each])) for each in observations]).numpy()
    results = [_beside(found, wanted, policy.env.action_space) for found in (together, singly)]
    equal = np.logical_and(*(same for same, _ in results))
    distances = np.maximum(*(distance for _, distance in results))
    if isinstance(module.network, Choice):  # where two are as good as tied, either may be taken
        with torch.no_grad():
            margins = module.network.margins(module.joined(batch(observations)))
        close = margins.numpy() <= ROUNDING
    else:
        close = distances <= ROUNDING
    others = int((~equal & ~close).sum())
    if others:
        raise WorkbenchError(
            f"not written: in {others} of {len(wanted)} observations it acts otherwise than the run's policy"
        )
    return Agreement(len(wanted), int(equal.sum()), float(distances.max()))


def _beside(
    found: np.ndarray, wanted: np.ndarray, space: spaces.Space[Any]
) -> tuple[np.ndarray, np.ndarray]:
    """Which actions are the same, (N,), and how far the continuous ones are apart, see `Agreement`: (N,)."""
    if found.shape != wanted.shape:
        raise WorkbenchError(
            f"not written: its actions' shape is {found.shape[1:]}, that of the run's {wanted.shape[1:]}"
        )
    same = (found == wanted).reshape(len(wanted), -1).all(axis=1)
    if not isinstance(space, spaces.Box):
        return same, np.zeros(len(wanted))
    extent = space.high.astype(float) - space.low
    extent = np.where(np.isfinite(extent) & (extent > 0.0), extent, 1.0)
    distances = np.abs(found.astype(float) - wanted) / extent
    return same, distances.reshape(len(wanted), -1).max(axis=1)
