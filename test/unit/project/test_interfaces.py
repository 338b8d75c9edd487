"""Every interface has the md5 sum that clients of Gazebo and ros_control were built with.

See docs/contract/interfaces.md 3.
"""

from __future__ import annotations

import json
import re
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


def page_of_the_contract(root):
    """The rows of docs/contract/interfaces.md: name, kind, md5 sum, fields."""
    package = ""
    for line in (root / "docs/contract/interfaces.md").read_text(encoding="utf-8").splitlines():
        heading = re.fullmatch(r"### 3\.\d+ (\w+)", line)
        package = heading[1] if heading else package
        row = re.fullmatch(r"\| (\w+) \((msg|srv)\) \| `(\w+)` \| (.*) \|", line)
        if row:
            yield f"{package}/{row[1]}", row[2], row[3], row[4]


def fields_on_the_page(text):
    """Type and name of each field in one part of a row; types without their packages."""
    found = []
    for group in text.split("; "):
        if "=" in group or group == "nothing":
            continue
        kind, names = group.split(" ", 1)
        found += [(kind.split("/")[-1], name) for name in names.split(", ")]
    return found


def fields_of(message):
    kinds = [kind.split("/")[-1] for kind in message._slot_types]
    return list(zip(kinds, message.__slots__, strict=True))


def test_the_contract_lists_every_type_with_its_sum(root):
    listed = {name: {"kind": kind, "md5": md5} for name, kind, md5, _ in page_of_the_contract(root)}
    assert listed == TABLE


def test_the_contract_lists_every_field_in_its_order(root):
    for name, kind, _, text in page_of_the_contract(root):
        found = LOOK_UP[kind](name)
        parts = [found] if kind == "msg" else [found._request_class, found._response_class]
        assert [fields_on_the_page(part) for part in text.split(" → ")] == [
            fields_of(part) for part in parts
        ], name
