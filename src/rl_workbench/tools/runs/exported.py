"""The file of an exported policy: TorchScript, and beside it in the same file what the policy is for."""

import io
import json
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium import spaces
from torch import nn

from files.content import open_file
from rl_workbench.errors import WorkbenchError

FORMAT = "rl_workbench policy 1"  # changes when older files can't be read any more
METADATA = "metadata.json"  # its name within the file
Observation = Any  # of one step: a float32 array, or a dict of those
_DAMAGED = (RuntimeError, ValueError, KeyError, zipfile.BadZipFile, zlib.error)


class ExportedPolicy(NamedTuple):
    """A policy from a file."""

    act: Callable[[Observation], Any]  # greedily, for one observation
    metadata: dict[str, Any]  # see `exporting.export`


def open_exported(path: Path) -> ExportedPolicy:
    """Reads an exported policy. TorchScript is a program: open files that you trust.

    Raises:
        WorkbenchError: if there is none, or it is damaged or something else.
    """
    try:
        with open_file(path) as file:
            content = file.read()
        # torch doesn't look at the check sums of a file that it reads.
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if archive.testzip():
                raise WorkbenchError(f"{path} is damaged")
        module, metadata = read(content)
    except OSError as error:
        raise WorkbenchError(f"can't read {path}: {error.strerror or error}") from error
    except _DAMAGED as error:
        raise WorkbenchError(f"{path} is damaged, or no exported policy") from error
    if metadata.get("format") != FORMAT:
        raise WorkbenchError(f"{path} is no exported policy of this version")

    @torch.no_grad()
    def act(observation: Observation) -> Any:
        return module(batch([observation]))[0].numpy()[()]

    return ExportedPolicy(act, metadata)


def written(module: nn.Module, metadata: dict[str, Any]) -> bytes:
    """The file's content."""
    memory = io.BytesIO()
    text = json.dumps(metadata, indent=1, allow_nan=False)
    with _no_deprecation():
        torch.jit.save(torch.jit.script(module), memory, _extra_files={METADATA: text})
    return memory.getvalue()


def read(content: bytes) -> tuple[torch.jit.ScriptModule, dict[str, Any]]:
    """What `written` wrote.

    Raises:
        RuntimeError, ValueError: if it is something else.
    """
    extra: dict[str, Any] = {METADATA: ""}
    with _no_deprecation():
        module = torch.jit.load(io.BytesIO(content), map_location="cpu", _extra_files=extra)
    metadata = json.loads(extra[METADATA])
    return module, metadata if isinstance(metadata, dict) else {}


@contextmanager
def _no_deprecation() -> Iterator[None]:
    """torch recommends its newer exporters wherever TorchScript is used."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        yield


def batch(observations: Sequence[Observation]) -> Any:
    """Observations as a module takes them: a tensor (N, ...), or a dict of those."""
    first = observations[0]
    if isinstance(first, dict):
        return {
            name: torch.from_numpy(np.stack([each[name] for each in observations]))
            for name in first
        }
    return torch.from_numpy(np.stack(observations))


def described(space: spaces.Space[Any]) -> dict[str, Any]:
    """A space in JSON; a bound that is infinite is null."""
    kind = type(space).__name__
    match space:
        case spaces.Dict():
            return {"kind": kind, "spaces": {name: described(each) for name, each in space.items()}}
        case spaces.Box():
            bounds = {"low": _finite(space.low), "high": _finite(space.high)}
            return {"kind": kind, "shape": list(space.shape), "dtype": str(space.dtype), **bounds}
        case spaces.Discrete():
            return {"kind": kind, "n": int(space.n), "start": int(space.start)}
        case spaces.MultiDiscrete():
            return {"kind": kind, "nvec": space.nvec.tolist()}
        case spaces.MultiBinary():
            return {"kind": kind, "shape": list(space.shape)}
    return {"kind": kind}


def _finite(bounds: Any) -> Any:
    if isinstance(bounds, np.ndarray):
        return [_finite(each) for each in bounds]
    return bounds.item() if np.isfinite(bounds) else None
