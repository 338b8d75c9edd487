"""Environment ids of Gymnasium: `module:namespace/Name-v0` or `namespace/Name-v0`."""

import contextlib
import re
from importlib import import_module
from typing import TYPE_CHECKING

from rl_workbench import errors
from rl_workbench.errors import EnvironmentFailure, WorkbenchError, error_line

if TYPE_CHECKING:
    from gymnasium.envs.registration import EnvSpec


def without_module(env_id: str) -> str:
    """Returns the id under which it is registered."""
    return env_id.partition(":")[2] or env_id


def as_file_name(env_id: str) -> str:
    """Returns an id as part of a file's name."""
    return re.sub("[/:]", "-", env_id)


def import_module_of(env_id: str) -> None:
    """Imports the module that an id names, if it names one."""
    module, colon, _ = env_id.partition(":")
    if not (module and colon):
        return
    try:
        import_module(module)
    except (Exception, SystemExit) as error:
        missing = error.name if isinstance(error, ModuleNotFoundError) else None
        if missing and f"{module}.".startswith(f"{missing}."):  # not one that it imports itself
            text = f"can't make {env_id}: there is no module '{missing}'"
            raise WorkbenchError(f"{text}; {errors.hints.modules}") from error
        raise EnvironmentFailure(f"can't make {env_id}: {error_line(error)}") from error


def spec_of(env_id: str) -> "EnvSpec | None":
    """Returns the registration of an id, once its module is imported."""
    import gymnasium  # --help needs none of it

    if without_module(env_id) not in gymnasium.registry:
        import_module_of(env_id)
    return gymnasium.registry.get(without_module(env_id))


def threshold(env_id: str) -> float | None:
    """Returns the return at which Gymnasium calls an environment solved, if it says so."""
    spec = None
    with contextlib.suppress(WorkbenchError):  # making the environment reports it
        spec = spec_of(env_id)
    return None if spec is None else spec.reward_threshold
