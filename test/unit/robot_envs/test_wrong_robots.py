"""What a user can get wrong in a robot's description: one line says what to mend."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.robots.grippers import transmission
from support.scenes.solo_arm import SOLO, Hold, episode, is_a_line
from support.scenes.two_arms import LEFT_CONTROLLERS

from robot_envs import InitialState, Pose, Robot, RobotEnv, RobotEnvError
from robot_envs.errors import TaskError
from robot_envs.scene import Scene

XACRO = '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">${nothing}</robot>'
GROUP = LEFT_CONTROLLERS["pair"]
DRIVES = """<gazebo><plugin name="drives" filename="libgazebo_ros_control.so">
  <robotNamespace>/right</robotNamespace></plugin></gazebo></robot>"""


def with_period(text, library="libgazebo_ros_control.so"):
    drives = f'filename="{library}"><controlPeriod>{text}</controlPeriod>'
    urdf = SOLO.xml.replace('filename="libgazebo_ros_control.so">', drives)
    assert urdf != SOLO.xml
    return urdf


def with_pair(**changes):
    return {**LEFT_CONTROLLERS, "pair": {**GROUP, **changes}}


ELBOW = {"type": "position_controllers/JointPositionController", "joint": "elbow"}
ROBOTS = {
    "no time": ({"control_period": 0.0}, "control_period must be a time above 0"),
    "half a step": ({"control_period": 0.0005}, "0.0005 s is not a multiple of the physics step 0.001 s"),
    "a world that isn't there": ({"world": "/nowhere/a.world"}, "its world: there is no file"),
    "another namespace than the URDF's": ({"namespace": "left", "urdf": SOLO.xml.replace("</robot>", DRIVES)},
        r"into the namespace '/right' \(<robotNamespace>\), the description into '/left'"),
    "a text for a time": ({"control_period": "40 ms"}, r"must be a time above 0 \[s\], not '40 ms'"),
    "a negative control period": ({"urdf": with_period("-0.1")},
        "<controlPeriod> -0.1 is not within 0 and 3600 s"),
    "a control period of more than an hour, for a library with its folder": (
        {"urdf": with_period("3601", "/opt/ros/lib/libgazebo_ros_control.so")},
        "<controlPeriod> 3601 is not within 0 and 3600 s",
    ),
    "no transmissions": ({"urdf": SOLO.xml.replace("transmission", "nothing")},
        "the robot 'arm': its URDF has no <transmission>: each joint that is to be"),
    "a transmission of no joint": (
        {"urdf": SOLO.xml.replace('<joint name="elbow"><hard', '<joint name="elbo"><hard')},
        "transmission of joint 'elbo': no such joint",
    ),
    "a controller that isn't described": ({"run": ("pear",)},
        "there is no controller 'pear' among its parameters; did you mean 'pair'"),
    "a joint that doesn't exist": ({"controllers": with_pair(joints=["elbo"])},
        "controller 'pair': there is no joint 'elbo'; did you mean 'elbow'"),
    "a joint without transmission": ({"controllers": with_pair(joints=["thread"])},
        "controller 'pair': joint 'thread' has no <transmission> in the URDF"),
    "another interface": (
        {"controllers": with_pair(type="effort_controllers/JointGroupEffortController")},
        "has hardware_interface::PositionJointInterface, and the controller needs "
        "hardware_interface::EffortJointInterface: its type and the joint's <transmission> must agree",
    ),
    "a type that doesn't exist": (
        {"controllers": with_pair(type="position_controllers/JointGroupPositionControler")},
        "no type '.*Controler'; did you mean 'position_controllers/JointGroupPositionController'",
    ),
    "two controllers of one joint": (
        {"run": ("pair", "one"), "controllers": {**LEFT_CONTROLLERS, "one": ELBOW}},
        "'pair' and 'one' both claim joint 'elbow'",
    ),
    "a controller twice": ({"run": ("pair", "pair")}, "the controllers to run name 'pair' twice"),
    "a name for names": ({"run": "pair"}, r"run lists names: \('pair',\) and not 'pair'"),
    "a command to what doesn't run": ({"commanded": ("pear",)},
        "'pear' is commanded, but not among the controllers that run; did you mean 'pair'"),
    "gains that are none": (
        {"controllers": {**LEFT_CONTROLLERS, "gazebo_ros_control": {"pid_gains": {"elbow": {"p": "x"}}}}},
        "gazebo_ros_control/pid_gains/elbow/p is 'x'",
    ),
    "a place that is none": ({"pose": (0, 0, 1)}, r"its pose is a Pose\(\(x, y, z\)\), not \(0, 0, 1\)"),
    "no package": ({"urdf": "package://my_rm/a.urdf"}, "there is no package 'my_rm' on ROS_PACKAGE_PATH"),
    "no URDF": ({"urdf": None}, "a file is a path .* not None"),
    "a broken URDF": ({"urdf": "<robot"}, "not well-formed XML"),
    "a broken world": ({"world": "<sdf><world"}, "world given as text: not well-formed XML"),
    "an engine that doesn't exist": ({"engine": "bulet"}, "no backend 'bulet'; did you mean 'bullet'"),
}  # fmt: skip


@pytest.mark.parametrize("case", ROBOTS)
def test_a_robot_that_cannot_be(case):
    changes, text = ROBOTS[case]
    with pytest.raises((RobotEnvError, ValueError), match=text) as error:
        episode(replace(SOLO, **changes))
    assert is_a_line(error.value)


def test_a_control_period_acts_in_whatever_folder_the_library_is():
    def joints(library):
        env = RobotEnv(replace(SOLO, urdf=with_period("10", library)), Hold())
        try:
            env.reset(seed=0)
            return [env.step(np.full(2, angle))[0].tolist() for angle in (0.1, 0.2, 0.3)]
        finally:
            env.close()

    plain = joints("libgazebo_ros_control.so")
    assert plain == joints("/opt/ros/lib/libgazebo_ros_control.so")
    assert plain != joints("libmy_gazebo_ros_control.so")


def test_all_faults_of_a_robot_are_told_at_once():
    robot = replace(SOLO, pose=Pose((math.nan, 0.0, 0.0)), run=("pear", "pair"))
    with pytest.raises(RobotEnvError) as error:
        robot.check()
    begun = ["the robot 'arm': ", "- its pose isn't fin", "- there is no contro"]
    assert [line[:20] for line in str(error.value).splitlines()] == begun


def test_gains_and_limits_of_joints_that_are_not_there_are_told_and_no_fault(caplog):
    """As in ros_control: a file may be for several robots."""
    strangers = {
        "gazebo_ros_control": {"pid_gains": {"elbo": {"p": 1.0}}},
        "joint_limits": {"sholder": {"has_effort_limits": True, "max_effort": 1.0}},
    }
    replace(SOLO, controllers={**LEFT_CONTROLLERS, **strangers}).check()
    assert "no joint 'elbo', which pid_gains names; did you mean 'elbow'" in caplog.text
    assert "no joint 'sholder', which joint_limits names; did you mean 'shoulder'" in caplog.text


@pytest.mark.parametrize(
    ("option", "name", "text"),
    [
        ("urdf", "arms.urdf", "there is no file .*arms.urdf; did you mean 'arm.urdf'"),
        ("urdf", "urdf/arm.urdf", "there is no file .*urdf/arm.urdf: there is no folder .*urdf"),
        ("urdf", "folder", "folder is a folder, not a file"),
        ("urdf", "broken.urdf", "can't read .*broken.urdf: unclosed token: line 1"),
        ("urdf", "broken.xacro", "can't read .*broken.xacro: name 'nothing' is not defined"),
        ("controllers", "arm.yml", "there is no file .*arm.yml; did you mean 'arm.yaml'"),
        ("controllers", "broken.yaml", "broken.yaml: line 1, column 6"),
        ("controllers", "list.yaml", "list.yaml: not a YAML file of parameters"),
        ("world", "hal.world", "there is no file .*hal.world; did you mean 'hall.world'"),
    ],
)
def test_files_that_cannot_be_read(tmp_path, option, name, text):
    for file, content in (
        ("arm.urdf", SOLO.xml), ("broken.urdf", "<robot"), ("broken.xacro", XACRO),
        ("arm.yaml", "a: 1"), ("broken.yaml", "a: [1"), ("list.yaml", "- 1"), ("hall.world", "<sdf/>"),
    ):  # fmt: skip
        (tmp_path / file).write_text(content)
    (tmp_path / "folder").mkdir()
    for given in (tmp_path / name, str(tmp_path / name)):
        with pytest.raises(RobotEnvError, match=text) as error:
            episode(replace(SOLO, **{option: given}))
        assert is_a_line(error.value)


def test_a_description_may_be_files_texts_and_mappings(tmp_path):
    (tmp_path / "arm.urdf").write_text(SOLO.xml)
    text = "pair:\n  type: position_controllers/JointGroupPositionController\n  joints: [elbow, shoulder]\n"
    (tmp_path / "arm.yaml").write_text(text)
    for urdf in (tmp_path / "arm.urdf", str(tmp_path / "arm.urdf"), lambda: tmp_path / "arm.urdf"):
        for controllers in (tmp_path / "arm.yaml", str(tmp_path / "arm.yaml"), text):
            episode(replace(SOLO, urdf=urdf, controllers=controllers))


def test_a_misspelt_option_is_told_with_the_nearest():
    with pytest.raises(TypeError, match="no option 'controler'; did you mean 'controllers'"):
        Robot(urdf=SOLO.xml, controler={})


def test_a_start_beyond_a_stop_is_told_once(caplog):
    """45 for 0.45 began an episode at the stop."""
    upper = SOLO.links.joints["elbow"].upper
    scene = Scene([SOLO])
    for start in (45.0, 45.0, upper + 0.001):
        scene.placed_joints(InitialState(joints={"elbow": start}))
    (record,) = caplog.records
    wanted = f"an episode puts the joint 'elbow' at 45, beyond its stops: it starts at {upper:g}"
    assert record.getMessage() == wanted


def test_an_episode_leaves_closed_loops_closed(root):
    """Joints that it doesn't place follow those that it does."""
    text = (root / "test/data/robots/four_bar_gripper.urdf").read_text()
    text = text.replace("</robot>", transmission("left_drive", "Effort") + "</robot>")
    scene = Scene([Robot(urdf=text)])
    placed = scene.placed_joints(InitialState(joints={"left_drive": (0.5, 1.0)}))
    for name, sign in (("left_drive", 1), ("left_link", 1), ("left_knuckle", -1), ("left_tip", 1)):
        assert placed[name] == pytest.approx((0.5 * sign, 1.0 * sign), abs=1e-6)
    with pytest.raises(TaskError, match=r"'left_link'\] where its robot's loops don't close"):
        scene.placed_joints(InitialState(joints={"left_drive": 0.5, "left_link": 0.3}))
