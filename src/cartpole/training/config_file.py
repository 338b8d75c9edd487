"""Tuned options in YAML: one file for each algorithm, one section for each environment."""

from pathlib import Path
from typing import Any

import yaml

from cartpole.errors import CartpoleError
from cartpole.training.options import unknown

TREE = Path(__file__).resolve().parents[3]


def default_file(name: str) -> Path:
    """The package's own config/<name>: in the source tree, or where rospkg finds the package.

    Raises:
        CartpoleError: if it is in neither.
    """
    path = TREE / "config" / name
    if path.is_file():
        return path
    import rospkg  # the source tree may be used without ROS

    try:
        return Path(rospkg.RosPack().get_path("cartpole")) / "config" / name
    except rospkg.ResourceNotFound as error:
        raise CartpoleError(
            f"config/{name} is neither in {TREE} nor in a package on ROS_PACKAGE_PATH"
        ) from error


def read_section(path: Path, env_id: str | None, preset: str | None) -> dict[str, Any]:
    """The options of a preset, or else of an environment; none where the file has none for it.

    A file without sections holds options that count for every environment.

    Raises:
        CartpoleError: if the file can't be read, or has no such preset.
    """
    content = _read(path)
    if content and not any(isinstance(value, dict) for value in content.values()):
        if preset:
            raise CartpoleError(f"{path} has no sections, so no preset {preset!r} either")
        return content
    name = preset or env_id or ""
    if preset and preset not in content:
        raise CartpoleError(f"{path}: {unknown('preset', preset, list(content))}")
    section = content.get(name) or {}
    if not isinstance(section, dict):
        raise CartpoleError(f"{path}: {name} isn't a section of options")
    return section


def _read(path: Path) -> dict[str, Any]:
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except OSError as error:
        raise CartpoleError(f"can't read {path}: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        text = " ".join(str(error).split())
        raise CartpoleError(f"{path} isn't YAML: {text}") from error
    if not isinstance(content, dict):
        raise CartpoleError(f"{path} isn't a YAML file of options")
    return content
