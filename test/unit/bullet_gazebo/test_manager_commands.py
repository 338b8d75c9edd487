"""The commands controller_manager and controller_group, and the filters of controller_manager_msgs."""

import pytest
from controller_manager_msgs.msg import ControllerState, HardwareInterfaceResources
from controller_manager_msgs.utils import (
    filter_by_hardware_interface,
    filter_by_name,
    filter_by_resources,
    filter_by_state,
    filter_by_type,
)

from bullet_gazebo.clients import manager_commands as commands

MANAGER = ["", "spin cart", "load", "unload", "start", "stop", "spawn", "sp", "kill", "kl", "list cart",
           "lc cart", "list-types x", "lt x", "--list", "reload-libraries --revert",
           "reload-libraries --restore now"]  # fmt: skip
GROUP = ["", "list upper", "spawn", "switch", "switch upper lower", "stop upper", "--list"]
HELP = ["-h", "--help"]


@pytest.mark.parametrize(
    ("main", "name", "line"),
    [(commands.main, "controller_manager", line) for line in MANAGER + HELP]
    + [(commands.group_main, "controller_group", line) for line in GROUP + HELP],
)
def test_what_is_no_command_is_answered_with_the_usage(main, name, line, capsys):
    # What roslaunch adds to each command line is no argument.
    with pytest.raises(SystemExit) as ended:
        main([name, *line.split(), "__name:=node", "__log:=file"])
    output, errors = capsys.readouterr()
    assert (output or errors).startswith(f"usage: {name} ")
    assert (ended.value.code, bool(output)) == ((0, True) if line in HELP else (2, False))


EFFORT, VELOCITY, STATE = (
    f"hardware_interface::{kind}Interface" for kind in ("EffortJoint", "VelocityJoint", "JointState")
)


def controller(name, kind, state, **claims):
    found = [
        HardwareInterfaceResources(f"hardware_interface::{interface}Interface", joints)
        for interface, joints in claims.items()
    ]
    return ControllerState(name, state, kind, found)


CONTROLLERS = [
    controller("states", "joint_state_controller/JointStateController", "running", JointState=[]),
    controller("arm", "effort_controllers/JointTrajectoryController", "running",
               EffortJoint=["elbow", "shoulder"]),
    controller("arm_position", "effort_controllers/JointPositionController", "stopped",
               EffortJoint=["elbow"]),
    controller("base", "mine/Base", "initialized", EffortJoint=["lift"], VelocityJoint=["wheel"]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("function", "arguments", "expected"),
    [
        (filter_by_name, ("arm",), ["arm"]),
        (filter_by_name, ("arm", True), ["arm", "arm_position"]),
        (filter_by_name, ("leg", True), []),
        (filter_by_type, ("mine/Base",), ["base"]),
        (filter_by_type, ("effort_controllers",), []),
        (filter_by_type, ("effort_controllers", True), ["arm", "arm_position"]),
        (filter_by_state, ("running",), ["states", "arm"]),
        (filter_by_state, ("ed", True), ["arm_position", "base"]),
        (filter_by_hardware_interface, (EFFORT,), ["arm", "arm_position", "base"]),
        (filter_by_hardware_interface, ("Velocity",), []),
        (filter_by_hardware_interface, ("Velocity", True), ["base"]),
        (filter_by_hardware_interface, (STATE,), ["states"]),
        (filter_by_resources, (["elbow"],), ["arm", "arm_position"]),
        (filter_by_resources, (["elbow", "shoulder"],), ["arm"]),
        (filter_by_resources, (["elbow", "shoulder"], None, True), ["arm", "arm_position"]),
        (filter_by_resources, (["lift", "wheel"],), []),  # not through one interface
        (filter_by_resources, (["lift", "wheel"], None, True), ["base"]),
        (filter_by_resources, (["wheel"], EFFORT), []),
        (filter_by_resources, (["wheel"], VELOCITY), ["base"]),
        (filter_by_resources, (["ghost"], None, True), []),
    ],
)
def test_filter(function, arguments, expected):
    assert [each.name for each in function(CONTROLLERS, *arguments)] == expected


def test_keyword_arguments_have_their_documented_names():
    assert filter_by_name(ctrl_list=CONTROLLERS, ctrl_name="arm", match_substring=False)
    assert filter_by_type(ctrl_list=CONTROLLERS, ctrl_type="mine", match_substring=True)
    assert filter_by_state(ctrl_list=CONTROLLERS, ctrl_state="run", match_substring=True)
    options = {"ctrl_list": CONTROLLERS, "hardware_interface": VELOCITY}
    assert filter_by_hardware_interface(**options, match_substring=True)
    assert filter_by_resources(**options, resources=["wheel"], match_any=False)
