"""Gymnasium's ids of environments: `module:namespace/Name-v0` or `namespace/Name-v0`."""

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
    """Returns the id under which it is registered."""
    return env_id.partition(":")[2] or env_id


def module_of(env_id: str) -> str:
    """Returns the module that registers it; empty if the id names none."""
    module, colon, _ = env_id.partition(":")
    return module if colon else ""


def as_file_name(env_id: str) -> str:
    """Returns an id as part of a file's name."""
    return re.sub("[/:]", "-", env_id)


FORM = "one of your own is named with its module, as in my_module:my_robot/Reach-v0"


def import_module_of(env_id: str) -> None:
    """Imports the module that an id names, if it names one.

    Raises:
        WorkbenchError: If there is no such module, or it fails.
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
    """Returns a hint at the module with the most similar name, if there is one."""
    package, _, name = missing.rpartition(".")
    folders: Any = import_module(package).__path__ if package else None
    near = get_close_matches(name, [each.name for each in iter_modules(folders)], 1)
    return f", did you mean {package}{'.' if package else ''}{near[0]}?" if near else ""


def unknown_environment(env_id: str) -> str:
    """Returns an error text for an unregistered id, with the nearest one or how to name one's own."""
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
    """Returns what is registered under an id, once its module is imported.

    Raises:
        WorkbenchError: If its module can't be imported.
    """
    if without_module(env_id) not in gymnasium.registry:
        import_module_of(env_id)
    return gymnasium.registry.get(without_module(env_id))


def threshold(env_id: str) -> float | None:
    """Returns the return at which Gymnasium calls an environment solved, if it says so."""
    spec = None
    with contextlib.suppress(WorkbenchError):  # making the environment reports it
        spec = spec_of(env_id)
    return None if spec is None else spec.reward_threshold
