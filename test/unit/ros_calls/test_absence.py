"""What is said of a service that nobody offers."""

from __future__ import annotations

import pytest

from ros_calls import master
from ros_calls.absence import why_absent, why_not_up
from ros_calls.master import Refused

WORLD = "/gazebo/get_world_properties"
LOCKSTEP = "roslaunch gazebo_ros empty_world.launch lockstep:=true"


@pytest.mark.parametrize(
    ("service", "offered", "words"),
    [
        ("/gazebo/step_world", WORLD, f"isn't in lock-step; start it with: {LOCKSTEP}"),
        ("/gazebo/step_world", "/sim/get_world_properties", "no simulator runs at"),
        ("/sim/set_link_friction", "", f"; start one with: {LOCKSTEP}"),
        ("/gazebo/set_link_properties", "", "no simulator runs at"),
        (WORLD, "", "start one with: roslaunch gazebo_ros empty_world.launch"),
        ("/controller_manager/list_controllers", WORLD, "no controller manager in the namespace /:"),
        ("/arm/controller_manager/list_controllers", "", "is the parameter /arm/robot_description"),
        ("/fake/set", WORLD, "no node offers this service"),
    ],
)
def test_what_is_missing_and_what_mends_it(monkeypatch, service, offered, words):
    def call(method, name):
        if name != offered:
            raise Refused(f"unknown service [{name}]")
        return "rosrpc://127.0.0.1:1"

    monkeypatch.setattr(master, "call", call)
    assert words in why_absent(service)
    assert words in why_not_up(service)


def test_a_node_that_is_there_and_silent(monkeypatch):
    monkeypatch.setattr(master, "call", lambda *_: "rosrpc://127.0.0.1:1")
    assert why_not_up(WORLD) == "its node doesn't answer"
