"""Imports of 0.2: modules and names that have moved are found, and say where they are."""

import pytest
from support.python import run_python


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("bullet_gazebo import Controller", "robot_sim.Controller"),
        ("bullet_gazebo.physics.world import World", "robot_sim.physics.world"),
        ("bullet_gazebo.control.pid import Pid", "robot_sim.control.pid"),
        (
            "bullet_gazebo.ros.plugins.plugin_loader import PluginContext",
            "bullet_gazebo.plugins.plugin_loader",
        ),
    ],
)
def test_an_old_import_says_where_it_is(old, new):
    name = old.split()[-1]
    there = f"from {new.removesuffix(f'.{name}')} import {name} as there"
    found = run_python(f"from {old} as it; {there}; assert it is there; print(there.__module__)")
    assert f"is {new} now" in found.stderr and found.stdout.strip()


def test_what_never_was_there_is_not_found():
    found = run_python("import bullet_gazebo.physics.nothing", check=False)
    assert "No module named 'bullet_gazebo.physics.nothing'" in found.stderr
