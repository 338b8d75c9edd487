"""What of this package a node has: a training comes to the same bits only where all have the same."""

import hashlib
import importlib.util
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options import default_file

PACKAGE = "rl_workbench"
LIBRARIES = ("numpy", "torch", "gymnasium")  # the bits depend on their versions, too


def own_packages() -> tuple[str, ...]:
    """The packages of this project, as they lie beside this one: in a source tree or a wheel."""
    installed = metadata.packages_distributions().get(PACKAGE, [])
    if installed:
        names = metadata.packages_distributions().items()
        return tuple(sorted(name for name, owners in names if set(owners) & set(installed)))
    return tuple(sorted(path.parent.name for path in _home().glob("*/__init__.py")))


def versions(packages: Sequence[str]) -> dict[str, str]:
    """Of the packages' sources and configuration, a digest; of the libraries, their versions."""
    digest = hashlib.sha256()
    home = _home()
    files = [path for name in packages for path in (home / name).rglob("*.py")]
    with_tree = [(path.relative_to(home).as_posix(), path) for path in files]
    config = [(path.name, path) for path in _config().glob("*.yaml")]
    for name, path in sorted(with_tree) + sorted(config):
        digest.update(f"{name}\0".encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    found = {name: metadata.version(name) for name in LIBRARIES if importlib.util.find_spec(name)}
    return {"our package": digest.hexdigest()[:12], **found}


def _home() -> Path:
    """The folder that holds the packages."""
    return Path(__file__).resolve().parents[3]


def _config() -> Path:
    try:
        return default_file("dqn.yaml").parent
    except WorkbenchError:  # a node without it has another digest
        return Path("/nonexistent")
