"""Imports of 0.2: modules and names that have moved are found, and say where they are."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("from bullet_gazebo import Controller as it", "robot_sim.Controller"),
        ("from bullet_gazebo.physics.world import World as it", "robot_sim.physics.world"),
        ("from bullet_gazebo.control.pid import Pid as it", "robot_sim.control.pid"),
        (
            "from bullet_gazebo.ros.plugins.plugin_loader import PluginContext as it",
            "bullet_gazebo.plugins.plugin_loader",
        ),
    ],
)
def test_an_old_import_says_where_it_is(old, new):
    name = old.split()[3]
    place = new.rpartition(".")[0] if new.endswith(name) else new
    check = (
        f"{old}; from {place} import {name} as there; assert it is there; print(there.__module__)"
    )
    found = subprocess.run(
        [sys.executable, "-c", check], capture_output=True, text=True, check=True
    )
    assert f"is {new} now" in found.stderr and found.stdout.strip()


def test_what_never_was_there_is_not_found():
    code = "import bullet_gazebo.physics.nothing"
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert "No module named 'bullet_gazebo.physics.nothing'" in found.stderr
