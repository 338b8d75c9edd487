"""The policy's node on a robot, without ROS's servers."""

import math
import threading
from types import SimpleNamespace

import numpy as np
import pytest
import rospy
from geometry_msgs.msg import Quaternion, Twist, Vector3
from gymnasium.spaces import Box
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, LaserScan
from std_msgs.msg import Header
from support.ros.silent_topics import SilentPublisher, SilentSubscriber, silence
from support.scenes.seeing_rover import SEEING

from robot_envs import Commands, Robot, StateQuery, Task, WorldState
from robot_envs.deployment import policy_node
from robot_envs.deployment.policy_node import PolicyNode
from robot_envs.robots.furuta import ROBOT as FURUTA
from robot_envs.robots.furuta import SwingUp
from robot_envs.robots.quadruped import ROBOT as QUADRUPED
from robot_envs.robots.quadruped import Walk
from robot_envs.robots.rover import ROBOT as ROVER
from robot_envs.robots.rover import Navigate
from robot_envs.world_state import JointState


class Reset(PolicyNode):
    """Begins, and its simulation is reset while it does the first step; ends when it has begun again."""

    def __init__(self) -> None:
        self._period, self.time, self.begun = 0.02, 70.0, 0
        self._joints = self._sensors = SimpleNamespace(forget=lambda: None)
        self._is_killed = threading.Event()
        self._should_end = lambda: self.begun == 2 or 1.0 < self.time < 70.0

    def now(self) -> float:
        self.time += 0.5
        return self.time

    def _begin(self) -> float:
        self.begun += 1
        return self.now()

    def _let_go(self) -> None:
        self.let_go = self.begun

    def _step(self, now: float, passed: float) -> None:
        self.time = 0.0


def test_a_reset_while_it_does_a_step_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    node = Reset()
    monkeypatch.setattr(rospy, "get_time", node.now)
    monkeypatch.setattr(rospy.rostime, "is_wallclock", lambda: False)
    node._follow()
    assert node.begun == 2 and node.let_go == 1, "it lets go before it begins anew"


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """With publishers and subscribers of nobody; lines are what is logged."""
    made = SimpleNamespace(now=5.0, lines=silence(monkeypatch))
    monkeypatch.setattr(rospy, "get_time", lambda: made.now)
    monkeypatch.setattr(policy_node, "ControllerWatch", lambda *_: SimpleNamespace(trouble=""))
    monkeypatch.setattr(policy_node, "POLL", 0.0)
    return made


@pytest.fixture
def furuta(clock: SimpleNamespace) -> PolicyNode:
    return PolicyNode(FURUTA, SwingUp(), lambda _: [1.0], FURUTA.control_period)


def commanded(node: PolicyNode) -> list[float]:
    (topic,) = node._topics.values()
    return [message.data for message in SilentPublisher.messages[topic.name]]


def know_joints(node: PolicyNode, robot: Robot, arrival: float = 5.0) -> None:
    for name in robot.joints:
        node._joints._known[name] = JointState(0.0, 0.0, 0.0), rospy.Time(5), arrival


def test_while_it_waits_again_no_effort_is_left_on(furuta: PolicyNode) -> None:
    polls = iter([False] * 3)
    furuta._should_end = lambda: next(polls, True)
    furuta._begin()
    assert commanded(furuta) == [], "nothing was commanded, and nothing is"
    furuta._last = {name: JointState(0.0, 0.0, 0.0) for name in FURUTA.joints}
    polls = iter([False] * 3)
    furuta._begin()
    assert commanded(furuta) == [0.0, 0.0, 0.0]


def test_it_stops_when_nobody_listens_any_more(furuta: PolicyNode, monkeypatch) -> None:
    know_joints(furuta, FURUTA)
    assert furuta._trouble(0.0) == ""
    monkeypatch.setattr(SilentPublisher, "get_num_connections", lambda self: 0)
    (topic,) = furuta._topics.values()
    assert furuta._trouble(0.0) == f"nobody listens to {topic.name} any more"


def test_messages_that_cannot_be_read_are_told_before_those_that_are_missing(furuta) -> None:
    fault = "the sensor 'camera': pictures are yuv422"
    furuta._sensors = SimpleNamespace(missing=lambda: ["/eye/image_raw"], fault=lambda: fault)
    know_joints(furuta, FURUTA)
    assert furuta._missing() == f"a message that can be read: {fault}"
    furuta._sensors.fault = str
    assert furuta._missing() == "a message on /eye/image_raw"


class Follow(Task):
    """The rover goes as fast as two sensors say."""

    query = StateQuery(sensors=("imu", "front_laser"))

    def action_space(self) -> Box:
        return Box(-1.0, 1.0, (1,), np.float32)

    observation_space = action_space

    def apply(self, action: np.ndarray, state: WorldState) -> Commands:
        return {"wheels": (float(action[0]), 0.0)}

    def observe(self, state: WorldState) -> np.ndarray:
        spin = state.sensors["imu"].angular_velocity[2]
        return np.array([np.float32(spin) * state.sensors["front_laser"].ranges[0]])

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        return 0.0


def test_a_policy_gets_its_sensors_from_topics_and_stops_when_they_are_silent(clock) -> None:
    node = PolicyNode(SEEING, Follow(), lambda seen: seen, 0.02, late=1.0)
    know_joints(node, SEEING)
    assert node._missing() == "a message on /imu, and a message on /scan"
    header = Header(stamp=rospy.Time(5))
    SilentSubscriber.send("/imu", Imu(header=header, angular_velocity=Vector3(0.0, 0.0, 0.5)))
    SilentSubscriber.send("/scan", LaserScan(header=header, ranges=[0.1, math.inf]))
    node._step(node._begin(), 0.0)
    assert commanded(node) == [[float(np.float32(0.5) * np.float32(0.1)), 0.0]]
    clock.now = 6.01
    know_joints(node, SEEING, clock.now)
    node._step(clock.now, 1.01)
    assert commanded(node)[-1] == [0.0, 0.0]
    assert clock.lines == ["no message on /imu for 1 s: the robot is stopped"]


def drives(node: PolicyNode) -> list[tuple[float, float]]:
    (topic,) = node._topics.values()
    assert topic.name == "/drive_controller/cmd_vel"
    return [(each.linear.x, each.angular.z) for each in SilentPublisher.messages[topic.name]]


def tell(now: float, x: float, scan: bool = True) -> None:
    """The rover is at (x, 0), looks along y, and drives at half its speed; something is 1 m away."""
    header = Header(stamp=rospy.Time(now))
    odometry = Odometry(header=header)
    odometry.pose.pose.position.x = x
    odometry.pose.pose.orientation = Quaternion(0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
    odometry.twist.twist.linear.x = 0.4
    SilentSubscriber.send("/odom", odometry)
    if scan:
        SilentSubscriber.send("/scan", LaserScan(header=header, ranges=[1.0] * 360))


def test_a_vehicle_drives_to_its_goal_by_laser_and_odometry_and_stops_when_they_are_late(
    clock: SimpleNamespace,
) -> None:
    seen: list[np.ndarray] = []
    act = lambda observed: seen.append(observed) or [1.0, -1.0]  # noqa: E731
    node = PolicyNode(ROVER, Navigate(), act, 0.2, late=1.0, goal=(3.0, 0.0))
    know_joints(node, ROVER)
    assert node._missing() == "a message on /scan, and a message on /odom"
    tell(5.0, 1.0)
    node._step(node._begin(), 0.0)
    assert drives(node) == [(0.8, -2.0)]
    assert seen[0][:24] == pytest.approx([0.3] * 24)
    assert seen[0][24:] == pytest.approx([0.5, 0.0, -1.0, 0.5, 0.0], abs=1e-6)
    node._take_goal(SimpleNamespace(data=(1.0, 4.0)))
    node._step(clock.now, 0.2)
    assert seen[1][24:] == pytest.approx([1.0, 1.0, 0.0, 0.5, 0.0], abs=1e-6), "ahead"
    for late, topic in ((True, "/odom"), (False, "/scan")):
        clock.now += 1.01
        know_joints(node, ROVER, clock.now)
        if late:
            header = Header(stamp=rospy.Time(clock.now))
            SilentSubscriber.send("/scan", LaserScan(header=header, ranges=[1.0] * 360))
        else:
            tell(clock.now, 1.0, scan=False)
        node._step(clock.now, 1.0)
        assert drives(node)[-1] == (0.0, 0.0)
        assert clock.lines.pop() == f"no message on {topic} for 1 s: the robot is stopped"
        node._next_report = 0.0
    tell(clock.now + 0.01, 1.0)
    node._aim_if_told()
    node._take_goal(SimpleNamespace(data=(1.1, 0.0)))
    node._step(clock.now, 1.0)
    assert drives(node)[-1] == (0.0, 0.0), "it is there"


def test_a_walker_stands_until_cmd_vel_says_where_to(clock: SimpleNamespace) -> None:
    seen: list[np.ndarray] = []
    act = lambda observed: seen.append(observed) or np.zeros(15, np.float32)  # noqa: E731
    node = PolicyNode(QUADRUPED, Walk(), act, 0.02, late=1.0)
    know_joints(node, QUADRUPED)
    header = Header(stamp=rospy.Time(clock.now))
    SilentSubscriber.send("/imu", Imu(header=header, orientation=Quaternion(0.0, 0.0, 0.0, 1.0)))
    node._step(node._begin(), 0.0)
    for x, y, turn in ((0.5, 0.1, -0.3), (9.0, 0.0, 0.0)):
        message = Twist(Vector3(x, y, 0.0), Vector3(0.0, 0.0, turn))
        SilentSubscriber.send("/cmd_vel", message)
        node._step(clock.now, 0.02)
    wanted = [(0.0, 0.0, 0.0), (0.5, 0.1, -0.3), (0.8, 0.0, 0.0)]
    assert [tuple(each[6:9]) for each in seen] == [pytest.approx(each) for each in wanted]
    assert not seen[0][-2:].any() and seen[1][-2:].any(), "its gait begins"
    clock.now += 0.4
    node._step(clock.now, 0.42)
    assert seen[-1][6] == pytest.approx(0.8)
    clock.now += 0.2
    node._step(clock.now, 0.62)
    assert not seen[-1][6:9].any(), "nobody commands it any more"


@pytest.mark.parametrize(
    ("robot", "task", "period", "late"),
    [(ROVER, Navigate, 0.2, 0.3), (ROVER, Navigate, 0.01, 0.1), (FURUTA, SwingUp, 0.2, 1.0)],
)
def test_a_vehicle_drives_on_for_a_third_of_a_second_at_most(
    clock: SimpleNamespace, robot: Robot, task: type[Task], period: float, late: float
) -> None:
    node = PolicyNode(robot, task(), lambda _: [0.0, 0.0], period)
    know_joints(node, robot)
    assert "no joint state" not in node._trouble(late)
    assert "no joint state" in node._trouble(late + 0.01)


def test_odometry_that_is_no_pose_is_a_fault(clock: SimpleNamespace) -> None:
    node = PolicyNode(ROVER, Navigate(), lambda _: [0.0, 0.0], 0.2)
    SilentSubscriber.send("/odom", Odometry(header=Header(stamp=rospy.Time(5))))
    assert "the sensor 'odometry': pose and speed are (0.0, 0.0, 0.0, 0.0" in node._sensors.fault()


def test_reasons_that_change_fast_are_a_line_a_second(furuta, clock, monkeypatch) -> None:
    lines, now = clock.lines, 0.0
    monkeypatch.setattr(rospy, "loginfo", lines.append)
    monkeypatch.setattr(policy_node, "time", SimpleNamespace(monotonic=lambda: now))
    for number in range(1000):
        now = 1.0 + number * 0.002
        furuta._report(f"state {number}")
    assert lines == ["state 0", "state 500 (499 other changes before)"]
    now = 2.5
    furuta._report("")
    assert len(lines) == 2, "it is told later"
    now = 3.5
    furuta._report("")
    assert lines[2:] == ["continuing (499 other changes before)"]
