"""Policies as TorchScript files with a description of the policy."""

import copy
import io
import json
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium import spaces
from torch import nn

from file_access.content import open_file
from rl_workbench.agents.greedy import Choice, SeveralChoices, Switches
from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import check_archive, reading
from rl_workbench.tools.policies import TEST_SEED, Player
from rl_workbench.tools.runs import Run
from rl_workbench.training.environments import as_float32
from rl_workbench.training.folder import library_versions

FORMAT = "rl_workbench policy 1"  # changes when older files can't be read any more
READ = {"env_id": str, "env_kwargs": dict, "observation_space": dict, "action_space": dict}
METADATA = "metadata.json"  # its name within the file
SAMPLES = 1000  # observations for the comparison
ROUNDING = 1e-4  # largest difference from summing the same float32 numbers in another order
Observation = Any  # of one step: a float32 array, or a dict of those


class ExportedPolicy(NamedTuple):
    """A policy read from a file."""

    act: Callable[[Observation], Any]  # greedily, for one observation
    metadata: dict[str, Any]  # see `export`


class Agreement(NamedTuple):
    """How a file's actions compare with the policy's."""

    observations: int
    equal: int  # observations with bit-identical actions
    largest_difference: float  # of continuous actions, as a share of the distance of their bounds


def open_exported(path: Path) -> ExportedPolicy:
    """Reads an exported policy. TorchScript is a program: open only files that you trust."""
    with reading(path, "is damaged, or no exported policy"), open_file(path) as file:
        check_archive(file)
        module, metadata = read(file.read())
    if metadata.get("format") != FORMAT:
        raise WorkbenchError(f"{path} is not an exported policy of this version")
    lacks = [name for name, kind in READ.items() if not isinstance(metadata.get(name), kind)]
    if lacks:
        raise WorkbenchError(
            f"{path}: its {METADATA} has no {' and no '.join(lacks)} that can be read"
        )

    @torch.no_grad()
    def act(observation: Observation) -> Any:
        return module(batch([observation]))[0].numpy()[()]

    return ExportedPolicy(act, metadata)


def written(module: nn.Module, metadata: dict[str, Any]) -> bytes:
    """Returns the content of the file."""
    memory = io.BytesIO()
    text = json.dumps(metadata, indent=1, allow_nan=False)
    with _no_deprecation():
        torch.jit.save(torch.jit.script(module), memory, _extra_files={METADATA: text})
    return memory.getvalue()


def read(content: bytes) -> tuple[torch.jit.ScriptModule, dict[str, Any]]:
    """Reads what `written` returned; raises RuntimeError or ValueError for anything else."""
    extra: dict[str, Any] = {METADATA: ""}
    with _no_deprecation():
        module = torch.jit.load(io.BytesIO(content), map_location="cpu", _extra_files=extra)
    metadata = json.loads(extra[METADATA])
    return module, metadata if isinstance(metadata, dict) else {}


@contextmanager
def _no_deprecation() -> Iterator[None]:
    """Suppresses torch's advice to use its newer exporters, which every use of TorchScript prints."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        yield


def batch(observations: Sequence[Observation]) -> Any:
    """Stacks observations for a module: a tensor (N, ...), or a dict of those."""
    first = observations[0]
    if isinstance(first, dict):
        return {
            name: torch.from_numpy(np.stack([each[name] for each in observations]))
            for name in first
        }
    return torch.from_numpy(np.stack(observations))


def described(space: spaces.Space[Any]) -> dict[str, Any]:
    """Describes a space as plain values for JSON; infinite bounds are None."""
    kind = type(space).__name__
    match space:
        case spaces.Dict():
            return {"kind": kind, "spaces": {name: described(each) for name, each in space.items()}}
        case spaces.Box():
            nothing: Any = None
            low, high = (
                np.where(np.isfinite(end), end, nothing) for end in (space.low, space.high)
            )
            about = {"shape": list(space.shape), "dtype": str(space.dtype)}
            return {"kind": kind, **about, "low": low.tolist(), "high": high.tolist()}
        case spaces.Discrete():
            return {"kind": kind, "n": int(space.n), "start": int(space.start)}
        case spaces.MultiDiscrete():
            return {"kind": kind, "nvec": space.nvec.tolist()}
        case spaces.MultiBinary():
            return {"kind": kind, "shape": list(space.shape)}
    return {"kind": kind}


class OfVectors(nn.Module):
    """Maps observations (N, D) of any number type to greedy actions (N, ...)."""

    def __init__(self, network: nn.Module) -> None:
        super().__init__()
        self.network = network

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.network(observations.float())


class OfDicts(nn.Module):
    """Maps a dict of observations (N, ...) of any number type to greedy actions (N, ...)."""

    def __init__(self, network: nn.Module, names: Sequence[str]) -> None:
        super().__init__()
        self.network, self.names = network, list(names)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        parts = [observations[name].float().flatten(1) for name in self.names]
        return self.network(torch.cat(parts, dim=1))


def export(run: Run, policy: Player, seed: int) -> tuple[bytes, Agreement]:
    """Returns the file's content, and how it compares with the policy.

    Raises WorkbenchError if the environment fails, its observations can't be exported, or the file would act
    differently.
    """
    if policy.network is None or policy.checkpoint is None:
        raise WorkbenchError(
            f"a policy of {run.folder} can't be exported: only Stable-Baselines3 computes it "
            "(images, or a --policy of your own)"
        )
    space, original = policy.env.observation_space, policy.env.unwrapped.observation_space
    module = _module(policy.network, space, run.env_id)
    # Read back, because the file's content is what must agree.
    agreement = _compare(read(written(module, {}))[0], policy, _observations(policy, seed))
    metadata = {
        "format": FORMAT,
        "env_id": run.env_id,
        "env_kwargs": run.env_kwargs,
        "wrapper": run.wrapper,
        "algorithm": run.algorithm,
        "experiment": run.experiment,
        "seed": run.seed,
        "checkpoint": policy.checkpoint.name,
        "steps": policy.steps,
        "observation_space": described(space),
        "flattened_from": None if original == space else described(original),
        "action_space": described(policy.env.action_space),
        "agreement": agreement._asdict(),
        "versions": library_versions(),
    }
    return written(module, metadata), agreement


def _module(network: nn.Module, space: spaces.Space[Any], env_id: str) -> OfVectors | OfDicts:
    own = copy.deepcopy(network).cpu().eval().requires_grad_(False)
    for layer in own.modules():
        if isinstance(layer, nn.Linear):  # TorchScript doesn't accept NumPy integers
            layer.in_features, layer.out_features = int(layer.in_features), int(layer.out_features)
    if not isinstance(space, spaces.Dict):
        return OfVectors(own)
    for name, part in space.items():
        if not isinstance(part, spaces.Box) or not np.issubdtype(part.dtype, np.floating):
            raise WorkbenchError(
                f"a policy of {env_id} can't be exported: part {name} of its observations is {part}"
            )
    return OfDicts(own, list(space))


def _observations(policy: Player, seed: int) -> list[Observation]:
    """Returns observations from episodes of alternating greedy and random actions."""
    env = policy.env
    env.action_space.seed(seed)
    met: list[Observation] = []
    observation, _ = env.reset(seed=TEST_SEED + seed)
    while len(met) < SAMPLES:
        met.append(as_float32(observation))
        action = policy.act(met[-1]) if len(met) % 2 else env.action_space.sample()
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            observation, _ = env.reset()
    return met


def _compare(
    file: torch.jit.ScriptModule, policy: Player, observations: list[Observation]
) -> Agreement:
    """Compares the file's actions with the policy's; raises WorkbenchError if more than rounding differs."""
    wanted = np.stack([np.asarray(policy.act(each)) for each in observations])
    with torch.no_grad():
        actions = file(batch(observations)).numpy()
    space = policy.env.action_space
    equal, distances = _differences(actions, wanted, space)
    is_continuous = isinstance(space, spaces.Box)
    wrong = distances > ROUNDING if is_continuous else ~equal
    if wrong.any() and not is_continuous:
        wrong &= ~_tied(policy, observations)
    if wrong.any():
        raise WorkbenchError(
            f"not written: in {wrong.sum()} of {len(wanted)} observations the file's actions differ from "
            "the run's policy"
        )
    return Agreement(len(wanted), int(equal.sum()), float(distances.max()))


def _tied(policy: Player, observations: list[Observation]) -> np.ndarray:
    """Returns whether rounding may change the choice, (N,)."""
    network = policy.network
    if not isinstance(network, Choice):
        return np.zeros(len(observations), bool)
    module = _module(network.scores, policy.env.observation_space, "")
    with torch.no_grad():
        scores = module(batch(observations))
    return (margins(network, scores) <= ROUNDING * scores.abs().amax(1).clamp_min(1.0)).numpy()


def margins(network: Choice, scores: torch.Tensor) -> torch.Tensor:
    """Returns how far scores (N, A) are from another choice, (N,)."""
    if isinstance(network, Switches):
        return scores.abs().amin(1)
    sizes = network.sizes if isinstance(network, SeveralChoices) else [scores.shape[1]]
    best = [each.topk(min(2, each.shape[1])).values for each in scores.split(sizes, dim=1)]
    return torch.stack([each[:, 0] - each[:, -1] for each in best]).amin(0)


def _differences(
    found: np.ndarray, wanted: np.ndarray, space: spaces.Space[Any]
) -> tuple[np.ndarray, np.ndarray]:
    """Returns which actions are equal, (N,), and the distances of continuous ones, (N,), see `Agreement`."""
    if found.shape != wanted.shape:
        raise WorkbenchError(
            f"not written: the shape of its actions is {found.shape[1:]}, that of the run's "
            f"{wanted.shape[1:]}"
        )
    same = (found == wanted).reshape(len(wanted), -1).all(axis=1)
    if not isinstance(space, spaces.Box):
        return same, np.zeros(len(wanted))
    extent = space.high.astype(float) - space.low
    extent = np.where(np.isfinite(extent) & (extent > 0.0), extent, 1.0)
    distances = np.abs(found.astype(float) - wanted) / extent
    return same, distances.reshape(len(wanted), -1).max(axis=1)
