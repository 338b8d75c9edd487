"""Tuned options in YAML: one file for each algorithm, one section for each environment."""

import contextlib
import importlib.util
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from rl_workbench.env_ids import without_module
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options.options import unknown

TREE = Path(__file__).resolve().parents[4]
SHARE = Path(__file__).resolve().parents[2] / "share"  # in a wheel (setup.py)


def default_file(name: str) -> Path:
    """The project's own config/<name>.

    It lies in the source tree around this module; in a wheel in its package; in a catkin workspace that
    it was installed in, where rospkg finds the package.

    Raises:
        WorkbenchError: if it is in none of them.
    """
    for folder in (TREE, SHARE):
        path = folder / "config" / name
        if path.is_file():
            return path
    if importlib.util.find_spec("rospkg"):
        import rospkg

        with contextlib.suppress(rospkg.ResourceNotFound):
            return Path(rospkg.RosPack().get_path("cartpole")) / "config" / name
    raise WorkbenchError(f"config/{name} is neither in {TREE} nor in a package on ROS_PACKAGE_PATH")


def section_names(form: str, env_id: str | None) -> tuple[str, ...]:
    """What an environment's section may be called: by its whole id, or without the module that registers it.

    Args:
        form: with `{env_id}`.
        env_id: None if no environment is named; then there are none.
    """
    ids = (env_id, without_module(env_id)) if env_id else ()
    return tuple(dict.fromkeys(form.format(env_id=each) for each in ids))


def read_section(path: Path, names: Sequence[str], preset: str | None) -> dict[str, Any]:
    """The options of a preset, or else of the first section that there is; none where there is none.

    A file without sections holds options that count for every environment.

    Args:
        path: the file.
        names: of sections, see `section_names`.
        preset: a section that has to be there.

    Raises:
        WorkbenchError: if the file can't be read, or has no such preset.
    """
    content = _read(path)
    if content and not any(isinstance(value, dict) for value in content.values()):
        if preset:
            raise WorkbenchError(f"{path} has no sections, so no preset {preset!r} either")
        return content
    name = preset or next((each for each in names if each in content), "")
    if preset and preset not in content:
        raise WorkbenchError(f"{path}: {unknown('preset', preset, list(content))}")
    section = content.get(name) or {}
    if not isinstance(section, dict):
        raise WorkbenchError(f"{path}: {name} isn't a section of options")
    return section


def _read(path: Path) -> dict[str, Any]:
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except OSError as error:
        raise WorkbenchError(f"can't read {path}: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        text = " ".join(str(error).split())
        raise WorkbenchError(f"{path} isn't YAML: {text}") from error
    if not isinstance(content, dict):
        raise WorkbenchError(f"{path} isn't a YAML file of options")
    return content
