"""Goals of a GripperActionController, tick by tick (docs/contract/sensors.md 13.1)."""

import math

import pytest
from support.robots.trajectory_rig import DT, GAINS, Listener, urdf

from robot_sim.control.controllers import built_in
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.transmissions import read_description


class Rig:
    """A running controller of the joint `rail`, which moves as the test says."""

    def __init__(self, interface="Effort", **params):
        hardware = RobotHardware(read_description(urdf(interface)))
        self.joint = hardware.joints["rail"]
        kind = built_in()[f"{interface.lower()}_controllers/GripperActionController"]
        self.controller = kind.create("grip", {"joint": "rail", "gains": GAINS} | params, hardware)
        self.controller.starting(0)
        self.controller.state = "running"

    def run(self, ticks, velocity=0.0):
        for _ in range(ticks):
            self.joint.velocity = velocity
            self.joint.position += velocity * DT
            self.controller.update(0, DT)  # a clock that stands still

    def pursue(self, position, effort=5.0, key="goal"):
        listener = Listener()
        self.controller.pursue(key, position, effort, listener)
        return listener


def test_a_goal_within_the_tolerance_is_reached_and_held():
    rig = Rig(goal_tolerance=0.02)
    told = rig.pursue(0.5)
    rig.run(479, velocity=1.0)
    assert told.outcomes == []
    assert len(told.samples) == 9
    assert told.samples[-1] == (pytest.approx(0.45), 0.0, False, False)
    rig.run(1, velocity=1.0)
    (outcome,) = told.outcomes
    assert outcome.kind == "succeeded"
    assert outcome.sample == (pytest.approx(0.48), 0.0, False, True)
    rig.run(1)
    assert rig.joint.command == pytest.approx(GAINS["rail"]["p"] * 0.02)


def test_a_gripper_that_stalls_aborts_and_squeezes_on_with_the_goals_effort():
    rig = Rig()
    told = rig.pursue(2.0, effort=5.0)
    rig.run(100, velocity=1.0)
    rig.joint.effort = 5.0
    rig.run(1000, velocity=0.0009)
    assert told.outcomes == []
    rig.run(1)
    (outcome,) = told.outcomes
    assert (outcome.kind, outcome.sample[1:]) == ("aborted", (5.0, True, False))
    rig.run(100)
    assert rig.joint.command == 5.0


def test_a_new_goal_cancels_the_old_one_and_a_canceled_one_is_held():
    rig = Rig(max_effort=0.3)
    first, second = rig.pursue(1.0), rig.pursue(-1.0, key="second")
    assert [each.kind for each in first.outcomes] == ["canceled"]
    rig.run(1)
    assert rig.joint.command == -5.0
    rig.controller.cancel("goal")
    assert second.outcomes == []
    rig.joint.position = -0.2
    rig.controller.cancel("second")
    assert [each.kind for each in second.outcomes] == ["canceled"]
    rig.joint.position = -0.4
    rig.run(1)
    assert rig.joint.command == 0.3


def test_the_effort_interface_has_no_force_without_max_effort_and_position_takes_the_place():
    rig = Rig()
    rig.joint.position = 1.0
    rig.run(1)
    assert rig.joint.command == 0.0
    rig.pursue(2.0, effort=0.0)
    rig.run(1)
    assert rig.joint.command == 0.0
    rig = Rig("Position")
    rig.pursue(0.7, effort=0.0)
    rig.run(1)
    assert rig.joint.command == 0.7


def test_goals_are_refused_while_it_does_not_run_or_that_are_no_numbers():
    rig = Rig()
    with pytest.raises(ControlError, match="must be finite"):
        rig.pursue(math.nan)
    told = rig.pursue(1.0)
    rig.controller.stopping()
    rig.controller.state = "stopped"
    assert [each.kind for each in told.outcomes] == ["canceled"]
    with pytest.raises(ControlError, match="it is not running"):
        rig.pursue(1.0)


@pytest.mark.parametrize(
    ("params", "told"),
    [
        ({"joint": "x"}, "joint 'x' is not in"),
        ({"gains": {}}, "No p gain specified for pid. Namespace: grip/gains/rail"),
        ({"action_monitor_rate": 0}, "must be more than 0"),
        ({"stall_timeout": "x"}, "grip/stall_timeout"),
    ],
)
def test_wrong_parameters_are_told(params, told):
    with pytest.raises(ControlError, match=told):
        Rig(**params)
