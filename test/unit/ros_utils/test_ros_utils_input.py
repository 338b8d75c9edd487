"""What ros_utils makes of its arguments: bad files, and a master that is not there."""

import math
import re
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_utils import ros_controllers, ros_gazebo, ros_launch, ros_node, ros_params, ros_spawn, ros_urdf
from ros_utils._internal.gazebo import launch as _gazebo_launch


@pytest.fixture
def parameters(tmp_path):
    path = tmp_path / "parameters.yaml"
    path.write_text("a: 1\n")
    return str(path)


CALLS = [
    ros_params.ros_load_yaml_from_path,
    lambda path: ros_gazebo.gazebo_pause_physics(),
    lambda path: ros_gazebo.gazebo_get_model_state("cartpole")[3],
    lambda path: ros_gazebo.gazebo_get_world_properties()[0],
    lambda path: ros_gazebo.gazebo_set_model_configuration("cartpole", ["cart_pole"], [0.0]),
    lambda path: ros_gazebo.gazebo_spawn_urdf_string("<robot name='r'/>")[0],
    lambda path: ros_gazebo.gazebo_spawn_urdf_param("robot_description")[0],
    lambda path: ros_controllers.spawn_controllers_srv(["joint_state_controller"], ns="/"),
    lambda path: ros_node.ros_node_from_pkg("robot_state_publisher", "robot_state_publisher"),
    lambda path: ros_spawn.init_robot_state_pub(max_pub_freq=10.0),
]


@pytest.fixture
def slept(monkeypatch):
    """How long each sleep was asked to take [s]: unlike the time that has passed it is the same on a
    busy machine."""
    asked, sleep = [], time.sleep
    monkeypatch.setattr(time, "sleep", lambda seconds: asked.append(seconds) or sleep(seconds))
    return asked


@pytest.mark.parametrize("call", CALLS)
def test_no_master(no_master, parameters, slept, capsys, call):
    assert call(parameters) is False
    assert sum(slept) < 1.0, "none is waited for"
    told = capsys.readouterr().err
    assert re.search(r"no ROS master at http://127.0.0.1:\d+ \(Connection refused\)", told)


@pytest.mark.slow
@pytest.mark.parametrize("call", [*CALLS[:2], lambda path: ros_gazebo.launch_Gazebo(gui=False)])
def test_a_master_that_does_not_answer(nobody_answers, parameters, monkeypatch, tmp_path, capsys, call):
    monkeypatch.setenv("ROS_MASTER_URI", nobody_answers)
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    assert call(parameters) is False
    assert capsys.readouterr().err.startswith("[ERROR]")


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("a: [1\nb: 2\n", r"line 2, column 2: .*expected"),
        ("- 1\n- 2\n", "expected .*found list"),
        ("", "no parameters"),
    ],
)
def test_a_broken_yaml_file(tmp_path, capsys, text, error):
    path = tmp_path / "broken.yaml"
    path.write_text(text)
    assert ros_params.ros_load_yaml_from_path(str(path)) is False
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(f"{re.escape(str(path))}: {error}", line)


XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("<robot>", "line 1"),
        (XACRO.format("${1/0}"), "division by zero"),
        (XACRO.format("$(find nix_pkg)"), "package 'nix_pkg' not found"),
    ],
)
def test_a_broken_xacro_file(tmp_path, capsys, text, error):
    path = tmp_path / "broken.xacro"
    path.write_text(text)
    assert ros_urdf.urdf_parse_from_path(str(path)) is None
    (line,) = capsys.readouterr().err.splitlines()
    assert str(path) in line and error in line


def test_xacro_arguments(tmp_path, capsys):
    path = tmp_path / "arm.xacro"
    path.write_text(XACRO.format('<xacro:arg name="size" default="1"/><link name="l$(arg size)"/>'))
    assert 'name="l1"' in ros_urdf.urdf_parse_from_path(str(path))
    assert 'name="l7"' in ros_urdf.urdf_parse_from_path(str(path), ["size:=7"])
    assert ros_urdf.urdf_parse_from_path(str(path), ["size=7"]) is None
    assert "expected 'name:=value'" in capsys.readouterr().err


def test_packages_and_files_that_do_not_exist(capsys):
    assert ros_urdf.urdf_parse_from_pkg("nix_pkg", "r.urdf") is None
    assert ros_params.ros_load_yaml_from_pkg("nix_pkg", "c.yaml") is False
    assert ros_launch.ros_launch_from_pkg("rospy", "nix.launch") is False
    assert ros_launch.ros_launch_from_path("/nix.launch") is False
    assert ros_node.ros_node_from_pkg("nix_pkg", "nix") is False
    assert ros_node.ros_node_from_pkg("rospy", "nix") is False
    answer = (False, "/nix.urdf: can't be read or expanded")
    assert ros_gazebo.gazebo_spawn_urdf_path("/nix.urdf") == answer
    assert capsys.readouterr().err.count("[ERROR]") == 7


@pytest.mark.parametrize(
    "arguments",
    [
        {"custom_world_pkg": "nix_pkg", "custom_world_name": "w.world"},
        {"custom_world_pkg": "gazebo_ros", "custom_world_name": "nix.world"},
        {"custom_world_pkg": "gazebo_ros"},
        {"custom_world_path": "/nix.world"},
    ],
)
def test_worlds_that_do_not_exist(no_master, capsys, arguments):
    assert not ros_gazebo.launch_Gazebo(**arguments)
    assert capsys.readouterr().err.startswith("[ERROR] launch_Gazebo: ")


def test_bad_node_arguments(capsys):
    executable = ("robot_state_publisher", "robot_state_publisher")
    assert not ros_node.ros_node_from_pkg(*executable, args="it's")
    assert "No closing quotation" in capsys.readouterr().err
    assert not ros_node.ros_node_from_pkg(*executable, name="a/b")
    assert "'a/b'" in capsys.readouterr().err


@given(st.lists(st.sampled_from(["/", "a", "b_1"])).map("".join))
def test_a_namespace_is_made_global(ns):
    made = ros_node._global(ns)
    assert re.fullmatch(r"/|(/\w+)+", made)
    assert made.replace("/", "") == ns.replace("/", "")


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_a_pose_that_is_not_finite_is_refused(number):
    spawned, text = ros_gazebo.gazebo_spawn_urdf_string("<robot name='r'/>", pos_x=number)
    assert not spawned
    assert "not finite" in text


@pytest.mark.parametrize(
    ("asked", "passed"),
    [({"seed": 0}, {"seed:=0"}), ({"seed": 7, "lockstep": True}, {"seed:=7", "lockstep:=True"}), ({}, set())],
)  # fmt: skip
def test_gazebo_gets_the_arguments_beyond_its_own_that_are_asked_for(no_master, monkeypatch, asked, passed):
    commands = []

    def start(command, *_):
        commands.append(command)
        raise _gazebo_launch.CannotStart("not here")

    monkeypatch.setattr(_gazebo_launch._roslaunch, "start", start)
    assert not ros_gazebo.launch_Gazebo(**asked)
    own = ("lockstep:=", "seed:=", "extra_gazebo_args:=")
    assert {each for each in commands[0] if each.startswith(own)} == passed
