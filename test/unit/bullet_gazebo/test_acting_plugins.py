"""Plugins by which clients push, pull and pose a model, on both engines, their topics caught."""

from __future__ import annotations

import gc
import math
import weakref
from collections import namedtuple
from typing import Any

import pytest
import rospy
from geometry_msgs.msg import Vector3, Wrench
from support.robots.grippers import cube
from support.ros.silent_topics import SilentPublisher, SilentSubscriber, silence
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bullet_gazebo.common.messages import to_transform
from bullet_gazebo.plugins import acting_plugins, gripper_plugins
from bullet_gazebo.plugins.plugin_loader import PluginRegistry
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.files.world_file import fill, parse_world
from robot_sim.physics.pose import Pose, from_rpy, to_rpy
from robot_sim.simulator import Simulator

MODEL = """<robot name="m">{links}<joint name="hinge" type="revolute"><parent link="body"/><child link="arm"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="9" velocity="9"/></joint>
<gazebo><plugin name="p" filename="libgazebo_ros_{library}.so">{elements}</plugin></gazebo></robot>"""
LINK = """<link name="{}"><inertial><mass value="{}"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1"
iyz="0" izz="0.1"/></inertial></link>"""
LINKS = LINK.format("body", 2.0) + LINK.format("arm", 0.5)


class Free:
    """A body with an arm, without weight."""

    def __init__(self, world: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        self.logged = silence(monkeypatch)
        self.sim = Simulator(world, lockstep=True)
        self.plugins = PluginRegistry(self.sim, None)

    def spawn(self, library: str, elements: str) -> Any:
        text = MODEL.format(links=LINKS, library=library, elements=elements)
        self.model = self.sim.world.spawn("m", parse_urdf(text), Pose((0.0, 0.0, 1.0)))
        self.plugins.load(self.model, "/")
        return self.model

    def advance(self, ticks: int) -> None:
        with self.sim.lock:
            self.sim.advance(ticks)


@pytest.fixture
def free(make_world, monkeypatch):
    return Free(make_world(gravity=(0.0, 0.0, 0.0)), monkeypatch)


def test_a_force_acts_in_each_step_until_the_next_one(free):
    free.spawn("force", "<bodyName>body</bodyName><topicName>push</topicName>")
    SilentSubscriber.send("/push", Wrench(Vector3(5.0, 0.0, 0.0), Vector3()))
    free.advance(500)
    assert free.model.link_state("body")[1][0][0] == pytest.approx(1.0, rel=0.02)  # 2.5 kg
    SilentSubscriber.send("/push", Wrench(Vector3(math.nan, 0.0, 0.0), Vector3()))
    assert "force.x is nan" in free.logged[-1]
    SilentSubscriber.send("/push", Wrench())
    free.advance(500)
    assert free.model.link_state("body")[1][0][0] == pytest.approx(1.0, rel=0.02)
    free.sim.delete_model(free.model)
    free.spawn("force", "<bodyName>body</bodyName>")
    assert free.logged[-1].endswith("<topicName> is missing")


def test_a_hand_of_god_pulls_a_link_to_a_frame_of_tf(free):
    free.spawn("hand_of_god", "<linkName>body</linkName><frameId>hand</frameId><ka>50</ka>")
    free.advance(100)
    assert free.model.link_state("body")[1] == ((0.0,) * 3, (0.0,) * 3)
    half = Pose((0.5, 0.0, 0.0), from_rpy(0.0, 0.0, 0.3))
    SilentSubscriber.send("/tf", to_transform(0, "world", "half", half))
    rest = Pose((0.0, 0.2, 0.5), from_rpy(0.2, 0.0, 0.0))
    SilentSubscriber.send("/tf", to_transform(0, "half", "hand_desired", rest))
    free.advance(3000)
    wanted, pose = half.compose(rest), free.model.link_state("body")[0]
    assert pose.position == pytest.approx(wanted.position, abs=1e-3)
    assert to_rpy(pose.orientation) == pytest.approx(to_rpy(wanted.orientation), abs=1e-2)
    sent = SilentPublisher.messages["/tf"][-1].transforms[0]
    assert (sent.header.frame_id, sent.child_frame_id) == ("world", "hand_actual")
    assert sent.transform.translation.x == pytest.approx(pose.position[0], abs=1e-3)


Attaching = namedtuple("Attaching", "model_name_1 link_name_1 model_name_2 link_name_2")


def test_a_link_attacher_keeps_nothing_of_models_that_are_gone(make_world, monkeypatch):
    world = make_world()
    monkeypatch.setattr(gripper_plugins.rospy, "Service", lambda *arguments: None)
    sim = Simulator(world, lockstep=True)
    attacher, gone = gripper_plugins.LinkAttacher(sim), []
    for number in range(3):
        names = f"first{number}", f"second{number}"
        request = Attaching(names[0], "cube_link", names[1], "cube_link")
        for place, name in enumerate(names):
            gone.append(weakref.ref(world.spawn(name, parse_urdf(cube()), Pose((place, 0.0, 1.0)))))
        assert attacher._attach(request).ok
        assert attacher._detach(request).ok
        assert not attacher._detach(request).ok
        assert attacher._attach(request).ok
        for name in names:
            world.delete(name)
        assert not attacher._detach(request).ok
    gc.collect()
    assert [each() for each in gone] == [None] * 6


def test_nothing_is_attached_to_an_actor(make_world, monkeypatch):
    world, sent = make_world(), []
    monkeypatch.setattr(gripper_plugins.rospy, "Service", lambda *arguments: None)
    monkeypatch.setattr(gripper_plugins.rospy, "logerr", lambda text, *names: sent.append(names))
    attacher = gripper_plugins.LinkAttacher(Simulator(world, lockstep=True))
    world.spawn("cube", parse_urdf(cube()), Pose((0.0, 0.0, 1.0)))
    trajectory = "<trajectory><waypoint><time>0</time></waypoint></trajectory>"
    actor = f'<actor name="a"><script>{trajectory}</script></actor>'
    text = f'<sdf version="1.6"><world name="w">{actor}</world></sdf>'
    assert list(fill(world, parse_world(text, Resources()).models)) == [("a", None)]
    assert not attacher._attach(Attaching("cube", "cube_link", "a", "a_pose")).ok
    assert len(sent) == 1


def test_a_second_vacuum_gripper_in_a_namespace_is_told_in_a_line(free):
    elements = "<bodyName>body</bodyName><topicName>held</topicName>"
    first = free.spawn("vacuum_gripper", elements)
    text = MODEL.format(links=LINKS, library="vacuum_gripper", elements=elements)
    second = free.sim.world.spawn("other", parse_urdf(text), Pose((2.0, 0.0, 1.0)))
    free.plugins.load(second, "/")
    [line] = free.logged
    assert "there is a service /on already: give each gripper a <robotNamespace>" in line
    free.sim.delete_model(first)


def test_a_hand_of_god_that_only_hears_itself_sends_nothing(free):
    free.spawn("hand_of_god", "<linkName>body</linkName>")
    sent, topic = SilentPublisher.messages["/tf"], SilentPublisher.open_ones["/tf"]
    topic.connections[0].endpoint_id = rospy.get_name()
    free.advance(3)
    assert not sent
    topic.connections[0].endpoint_id = "/rviz"
    free.advance(3)
    assert len(sent) == 3


def test_a_trajectory_sets_joints_point_by_point_and_keeps_a_link(free):
    free.spawn("joint_pose_trajectory", "")
    arm = free.model.link_state("arm")[0]
    message = JointTrajectory(joint_names=["hinge"])
    message.header.frame_id = "arm"
    for position in (0.5, -0.5, 1.0):
        time = rospy.Duration(0.1)
        message.points.append(JointTrajectoryPoint(positions=[position], time_from_start=time))
    SilentSubscriber.send("/set_joint_trajectory", message)
    seen = []
    for _ in range(3):
        free.advance(90)
        seen.append(free.model.joint_state("hinge")[0])
        free.advance(10)
    assert seen == pytest.approx([0.5, -0.5, 1.0], abs=1e-6)
    kept = free.model.link_state("arm")[0]
    assert kept.position == pytest.approx(arm.position, abs=1e-5)
    assert to_rpy(kept.orientation) == pytest.approx(to_rpy(arm.orientation), abs=1e-5)
    yaw = to_rpy(free.model.link_state("body")[0].orientation)[2]
    assert yaw == pytest.approx(-1.0, abs=1e-5)
    for change, words in (
        ({"joint_names": ["other"]}, "the model has no joint other"),
        ({"joint_names": ["hinge", "hinge"]}, "not as many positions"),
    ):
        for name, value in change.items():
            setattr(message, name, value)
        SilentSubscriber.send("/set_joint_trajectory", message)
        assert words in free.logged[-1]


def test_wheel_slip_is_accepted(free, monkeypatch):
    offered = []

    class Server:
        def __init__(self, parameters, apply, namespace):
            offered.append((namespace, [each.name for each in parameters]))

        def shutdown(self):
            offered.clear()

    monkeypatch.setattr(acting_plugins, "DynamicServer", Server)
    free.spawn("wheel_slip", "")
    ways = ("lateral", "longitudinal")
    assert offered == [("/m/wheel_slip", [f"slip_compliance_unitless_{way}" for way in ways])]
    assert not free.logged
    free.plugins.unload(free.model)
    assert not offered
