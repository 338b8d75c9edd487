"""A command's own flags and ROS's: looked at only where ROS has started the command."""

import sys

import pytest
from support.python import run_python

from cartpole.workbench import ros_options
from robot_envs.backends.ros import node
from robot_envs.errors import RobotEnvError

NOBODY = "http://127.0.0.1:1"  # refuses at once


@pytest.fixture(autouse=True)
def _no_master(monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", NOBODY)
    monkeypatch.delenv("ROS_NAMESPACE", raising=False)


def test_ross_options_without_ros_are_an_error_in_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "rospy", None)
    with pytest.raises(RobotEnvError, match="an argument with := needs ROS"):
        ros_options(["__name:=learner"], "learner")


def test_without_ross_options_the_arguments_are_the_flags_and_ros_is_not_loaded():
    script = (
        "import sys; from cartpole.workbench import ros_options;"
        "print(ros_options(['--seed=3', 'x'], 'learner'),"
        " [m for m in ('rospy', 'rosgraph', 'roslib', 'genpy', 'ros_utils') if m in sys.modules])"
    )
    shown = run_python(script, env={"PYTHONPATH": ":".join(filter(None, sys.path))})
    assert shown.stdout.strip() == "(['--seed=3', 'x'], {}, '/learner') []"


@pytest.mark.parametrize(
    ("namespace", "name"), [("", "/learner"), ("/a/", "/a/learner"), ("a/b", "/a/b/learner")]
)
def test_the_nodes_name_is_in_its_namespace(monkeypatch, namespace, name):
    monkeypatch.setenv("ROS_NAMESPACE", namespace)
    assert ros_options([], "learner")[2] == name
    assert ros_options(["_x:=1"], "learner")[2] == name


def test_ross_options_are_taken_out_and_private_ones_are_parameters():
    argv = ["--seed=3", "_gamma:=0.9", "_dueling:=true", "__name:=mine", "__log:=f", "old:=new"]
    assert ros_options(argv, "learner") == (["--seed=3"], {"gamma": 0.9, "dueling": True}, "/mine")


def test_the_command_line_wins_over_the_master(monkeypatch):
    asked = []

    def parameters(name):
        asked.append(name)
        return {"gamma": 0.5, "seed": 1}

    monkeypatch.setattr(node, "private_parameters", parameters)
    assert ros_options(["_gamma:=0.9"], "learner")[1] == {"gamma": 0.9, "seed": 1}
    assert asked == ["/learner"]


def test_what_is_no_yaml_is_an_error():
    with pytest.raises(RobotEnvError, match="invalid command-line parameters"):
        ros_options(["_gamma:=[1"], "learner")


def test_a_master_that_does_not_answer_matters_to_launched_nodes_only(monkeypatch):
    def refuse(name):
        raise RobotEnvError("no ROS master")

    monkeypatch.setattr(node, "private_parameters", refuse)
    assert ros_options(["_gamma:=0.9"], "learner")[1] == {"gamma": 0.9}
    with pytest.raises(RobotEnvError, match="no ROS master"):
        ros_options(["_gamma:=0.9", "__name:=learner"], "learner")
