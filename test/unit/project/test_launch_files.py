"""`roslaunch --ros-args` explains every argument of a launch file."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[3]
PLACES = ("launch", "companions", "examples", "test/ros", "test/data")
LAUNCH_FILES = sorted(path for place in PLACES for path in (ROOT / place).rglob("*.launch"))


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def arguments(path: Path) -> list[ElementTree.Element]:
    """What a launch file may be given, without what it gives to others."""
    root = ElementTree.parse(path).getroot()
    given = [each for include in root.iter("include") for each in include]
    return [each for each in root.iter("arg") if each not in given]


@pytest.mark.parametrize("path", LAUNCH_FILES, ids=name)
def test_every_argument_has_a_text(path: Path) -> None:
    silent = [each.get("name") for each in arguments(path) if not each.get("doc", "").strip()]
    assert silent == []
