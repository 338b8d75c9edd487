"""Ids of environments as text: `module:namespace/Name-v0` or `namespace/Name-v0`, as Gymnasium has them."""

import contextlib
import re
from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec

from rl_workbench.errors import EnvironmentFailure, WorkbenchError, error_line, finding_modules


def without_module(env_id: str) -> str:
    """The id under which it is registered."""
    return env_id.partition(":")[2] or env_id


def module_of(env_id: str) -> str:
    """The module that registers it; empty if the id names none."""
    module, colon, _ = env_id.partition(":")
    return module if colon else ""


def as_file_name(env_id: str) -> str:
    """For the names of files and folders."""
    return re.sub("[/:]", "-", env_id)


FORM = "one of your own is named with its module, as in my_module:my_robot/Reach-v0"


def import_module_of(env_id: str) -> None:
    """Imports the module that an id names, if it names one.

    Raises:
        WorkbenchError: if there is no such module, naming the nearest, or it fails.
    """
    module = module_of(env_id)
    if not module:
        return
    try:
        import_module(module)
    except (Exception, SystemExit) as error:
        missing = error.name if isinstance(error, ModuleNotFoundError) else None
        if missing and f"{module}.".startswith(f"{missing}."):  # not one that it imports itself
            text = f"can't make {env_id}: there is no module '{missing}'{_nearest(missing)}"
            raise WorkbenchError(f"{text}; {finding_modules()}") from error
        raise EnvironmentFailure(f"can't make {env_id}: {error_line(error)}") from error


def _nearest(missing: str) -> str:
    """The words for the module whose name is most alike; none if there is none."""
    package, _, name = missing.rpartition(".")
    folders: Any = import_module(package).__path__ if package else None
    near = get_close_matches(name, [each.name for each in iter_modules(folders)], 1)
    return f", did you mean {package}{'.' if package else ''}{near[0]}?" if near else ""


def unknown_environment(env_id: str) -> str:
    """The words for an id that isn't registered: the nearest one, or how one's own are named."""
    near = get_close_matches(without_module(env_id), sorted(gymnasium.registry), 1)
    module = module_of(env_id)
    text = f"unknown environment {env_id!r}"
    if not near:
        registered = f"; {module} registers none of that name" if module else f"; {FORM}"
        return text + registered
    is_its = near[0].rpartition("/")[0] == without_module(env_id).rpartition("/")[0]
    text += f"; did you mean {f'{module}:' if module and is_its else ''}{near[0]}?"
    return text if module or is_its else f"{text} {FORM[0].upper()}{FORM[1:]}"


def spec_of(env_id: str) -> EnvSpec | None:
    """What is registered under an id, once its module is imported; None if nothing is.

    Raises:
        WorkbenchError: if its module can't be imported.
    """
    if without_module(env_id) not in gymnasium.registry:
        import_module_of(env_id)
    return gymnasium.registry.get(without_module(env_id))


def threshold(env_id: str) -> float | None:
    """The return from which Gymnasium calls an environment solved, if it says so."""
    spec = None
    with contextlib.suppress(WorkbenchError):  # who makes the environment says so
        spec = spec_of(env_id)
    return None if spec is None else spec.reward_threshold
