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
from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import check_archive, reading
from rl_workbench.tools.policies import Player
from rl_workbench.tools.runs import Run
from rl_workbench.training.folder import library_versions

FORMAT = "rl_workbench policy 1"  # changes when older files can't be read any more
READ = {"env_id": str, "env_kwargs": dict, "observation_space": dict, "action_space": dict}
METADATA = "metadata.json"  # its name within the file
Observation = Any  # of one step: a float32 array, or a dict of those


class ExportedPolicy(NamedTuple):
    """A policy read from a file."""

    act: Callable[[Observation], Any]  # greedily, for one observation
    metadata: dict[str, Any]  # see `export`


def open_exported(path: Path) -> ExportedPolicy:
    """Reads an exported policy. TorchScript is a program: open only files that you trust."""
    with reading(path, "is damaged, or no exported policy"), open_file(path) as file:
        check_archive(file)
        module, metadata = read(file.read())
    if metadata.get("format") != FORMAT:
        raise WorkbenchError(f"{path} is not an exported policy of this version")
    lacks = [name for name, kind in READ.items() if not isinstance(metadata.get(name), kind)]
    if lacks:
        raise WorkbenchError(f"{path}: its {METADATA} has no {' and no '.join(lacks)} that can be read")

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
        return {name: torch.from_numpy(np.stack([each[name] for each in observations])) for name in first}
    return torch.from_numpy(np.stack(observations))


def described(space: spaces.Space[Any]) -> dict[str, Any]:
    """Describes a space as plain values for JSON; infinite bounds are None."""
    kind = type(space).__name__
    match space:
        case spaces.Dict():
            return {"kind": kind, "spaces": {name: described(each) for name, each in space.items()}}
        case spaces.Box():
            nothing: Any = None
            low, high = (np.where(np.isfinite(end), end, nothing) for end in (space.low, space.high))
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


def export(run: Run, policy: Player) -> bytes:
    """Returns the content; raises WorkbenchError for a policy or observations that can't be exported."""
    if policy.network is None or policy.checkpoint is None:
        raise WorkbenchError(
            f"a policy of {run.folder} can't be exported: only Stable-Baselines3 computes it "
            "(images, or a --policy of your own)"
        )
    space, original = policy.env.observation_space, policy.env.unwrapped.observation_space
    module = _module(policy.network, space, run.env_id)
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
        "versions": library_versions(),
    }
    return written(module, metadata)


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
