"""Every interface has the md5 sum that clients of Gazebo and ros_control were built with.

See docs/contract/interfaces.md 3.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import roslib.message

TABLE = json.loads((Path(__file__).parents[2] / "data/interfaces_md5.json").read_text())
LOOK_UP = {"msg": roslib.message.get_message_class, "srv": roslib.message.get_service_class}


@pytest.mark.parametrize("name", TABLE)
def test_md5(name):
    expected = TABLE[name]
    found = LOOK_UP[expected["kind"]](name)
    assert found is not None, f"{name} is in no package of the workspace"
    assert found._md5sum == expected["md5"]


def test_our_packages_hold_nothing_else(root):
    """A type without a contract would be one that nobody checks."""
    found = {
        f"{file.parent.parent.name}/{file.stem}"
        for package in ("gazebo_msgs", "control_msgs", "controller_manager_msgs")
        for kind in ("msg", "srv")
        for file in (root / "companions" / package / kind).iterdir()
    }
    assert found <= set(TABLE)
