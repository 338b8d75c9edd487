"""The window's name as a node, before it is one."""

import pytest

from bullet_gazebo.ros.clients import gzclient


@pytest.mark.parametrize(
    ("line", "dead", "living", "anonymous"),
    [
        ("", [], [], False),
        ("", ["/gazebo_gui"], [], False),
        ("", [], ["/gazebo_gui"], True),
        ("__name:=gazebo_gui", [], ["/gazebo_gui"], False),
        ("__ns:=/second", [], ["/gazebo_gui"], False),
        ("__ns:=/second", [], ["/second/gazebo_gui"], True),
    ],
)
def test_another_window_keeps_its_name(line, dead, living, anonymous, master, monkeypatch):
    monkeypatch.delenv("ROS_NAMESPACE", raising=False)
    master.nodes.update(dict.fromkeys(dead, "http://127.0.0.1:1"))
    master.nodes.update(dict.fromkeys(living, master.uri))
    taken = []
    monkeypatch.setattr(gzclient, "init_node", lambda name, _, anonymous: taken.append(anonymous))
    gzclient.become_node(["gzclient", *line.split()])
    assert taken == [anonymous]
