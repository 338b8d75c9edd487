"""What the log says about a robot whose control differs from Gazebo's, or fails."""

import threading
from contextlib import ExitStack
from types import SimpleNamespace

import rospy

from bullet_gazebo.plugins import control_plugin
from bullet_gazebo.plugins.control_plugin import ControlPlugin


def test_a_foreign_kind_of_simulation_and_missing_control_have_lines_of_their_own(monkeypatch):
    told = []
    for level in ("logwarn", "logfatal"):
        monkeypatch.setattr(rospy, level, lambda text, *args: told.append(text % args))
    monkeypatch.setattr(rospy, "get_param", lambda *_: {})
    monkeypatch.setattr(control_plugin, "find_param", lambda *_: "no XML")
    plugin = ControlPlugin.__new__(ControlPlugin)
    plugin._context = SimpleNamespace(
        model=SimpleNamespace(name="arm"), text=lambda *_: "their_sim/TheirSim"
    )
    plugin._namespace, plugin._parameter = "/arm", "robot_description"
    plugin._gone, plugin._lock, plugin._started = threading.Event(), threading.Lock(), ExitStack()
    assert plugin._try_start()
    sim_type, control = told
    assert sim_type.startswith(
        "Model 'arm': the <robotSimType> their_sim/TheirSim is not simulated"
    )
    assert "model 'arm' can't start, so this robot has no control here: robot_desc" in control
