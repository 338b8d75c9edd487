"""What a robot's sensors send, in real time: topics and messages, without ROS's servers."""

import contextlib
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import rospy
from sensor_msgs.msg import Image, Imu, LaserScan, Range
from std_msgs.msg import Header
from support.ros.silent_topics import SilentSubscriber, silence
from support.scenes.seeing_rover import NAMES, SEEING

from robot_envs import InitialState, RobotEnvError, SimulatorError, StateQuery
from robot_envs.backends.ros import realtime
from robot_envs.backends.ros.realtime import RealtimeWorld
from robot_envs.backends.ros.running import SharedWorld
from robot_envs.backends.ros.sensor_listener import SensorListener
from robot_envs.scene import Scene
from robot_envs.world_state import JointState

HEADER = Header(stamp=rospy.Time(7, 500_000_000))


class Heard:
    """What is subscribed to, and a clock."""

    topics, send = SilentSubscriber.open, SilentSubscriber.send
    now = 0.0  # [s]


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> Heard:
    silence(monkeypatch)
    return Heard()


def listener(heard: Heard, *names: str, robot: Any = SEEING) -> SensorListener:
    return SensorListener(robot, names, lambda: heard.now)


def picture(encoding: str, data: np.ndarray) -> Image:
    height, width = data.shape[:2]
    return Image(HEADER, height, width, encoding, 0, data.nbytes // height, data.tobytes())


def test_topics_are_those_that_the_plugins_name(heard: Heard) -> None:
    found = listener(heard, *NAMES)
    wanted = "/scan /sonar /imu /eye/image_raw /deep/depth/image_raw /bumper_states /old_imu"
    assert list(heard.topics) == wanted.split() == found.missing()
    found.close()
    assert not heard.topics
    scan = "<topicName>scan"
    text = str(SEEING.urdf).replace(scan, f"<robotNamespace>own</robotNamespace>{scan}")
    robot = replace(SEEING, urdf=text, namespace="left", sensor_topics={"imu": "/phone/imu"})
    listener(heard, "front_laser", "sonar", "seeing::imu", robot=robot)
    assert list(heard.topics) == ["/own/scan", "/left/sonar", "/phone/imu"]


def test_unknown_sensors_and_topics_are_told(heard: Heard) -> None:
    with pytest.raises(RobotEnvError, match="no sensor 'sonarr'; did you mean 'sonar'"):
        listener(heard, "sonarr")
    velodyne = str(SEEING.urdf).replace("libgazebo_ros_laser", "libgazebo_ros_velodyne_laser")
    robot = replace(SEEING, urdf=velodyne)
    with pytest.raises(RobotEnvError, match="topic of the sensor 'front_laser' isn't known"):
        listener(heard, "front_laser", robot=robot)
    listener(heard, "front_laser", robot=replace(robot, sensor_topics={"front_laser": "/scan"}))
    assert list(heard.topics) == ["/scan"]


def test_messages_become_readings(heard: Heard) -> None:
    found = listener(heard, "front_laser", "sonar", "imu", "camera", "deep")
    colours = np.arange(18, dtype=np.uint8).reshape(2, 3, 3)
    depths = np.array([[0.5, np.nan]], np.float32)
    imu = Imu(header=HEADER)
    imu.linear_acceleration.z, imu.orientation.w = 9.8, 1.0
    heard.send("/scan", LaserScan(header=HEADER, ranges=[0.1, float("inf")]))
    heard.send("/sonar", Range(header=HEADER, range=0.3))
    heard.send("/imu", imu)
    heard.send("/eye/image_raw", picture("bgr8", colours))
    assert found.missing() == ["/deep/depth/image_raw"] and not found.wait(0.0)
    heard.send("/deep/depth/image_raw", picture("32FC1", depths))
    assert found.wait(0.0)
    sensors = found.read(begin=5.0)
    assert sensors["front_laser"].ranges.tolist() == [pytest.approx(0.1), np.inf]
    assert sensors["front_laser"].time == 2.5
    assert sensors["sonar"].ranges.dtype == np.float32
    assert sensors["imu"].linear_acceleration.tolist() == [0.0, 0.0, 9.8]
    assert sensors["imu"].orientation.tolist() == [0.0, 0.0, 0.0, 1.0]
    assert np.array_equal(sensors["camera"].image, colours[..., ::-1])
    assert np.array_equal(sensors["deep"].depth, depths, equal_nan=True)
    heard.send("/deep/depth/image_raw", picture("16UC1", np.array([[500, 0]], np.uint16)))
    assert np.array_equal(found.read(0.0)["deep"].depth, depths, equal_nan=True)
    heard.send("/eye/image_raw", picture("mono8", colours[..., 0]))
    assert np.array_equal(found.read(0.0)["camera"].image, colours[..., [0, 0, 0]])


@pytest.mark.parametrize(
    ("name", "topic", "old", "new", "most"),
    [
        ("imu", "/imu", "<updateRateHZ>100</updateRateHZ>", "", 3.0),  # by default it is 1 Hz
        ("imu", "/imu", "<updateRateHZ>100", "<updateRateHZ>500", 0.03),  # the sensor is slower
        ("sonar", "/sonar", "<topicName>sonar", "<updateRate>2</updateRate><topicName>sonar", 1.5),
        ("old_imu", "/old_imu", "<updateRate>60", "<updateRate>20", 0.15),
    ],
)
def test_the_slower_rate_of_sensor_and_plugin_counts(heard, name, topic, old, new, most) -> None:
    text = str(SEEING.urdf)
    assert old in text
    found = listener(heard, name, robot=replace(SEEING, urdf=text.replace(old, new)))
    heard.send(topic, heard.topics[topic].data_class(header=HEADER))
    heard.now = most - 0.001
    assert found.trouble(late=0.01) == ""
    heard.now = most + 0.001
    assert found.trouble(late=0.01) == f"no message on {topic} for {most:g} s"


def test_a_pause_makes_nothing_late(heard: Heard) -> None:
    found = listener(heard, "front_laser")
    heard.send("/scan", LaserScan(header=HEADER))
    heard.now = 60.0
    found.resume()
    heard.now = 64.9
    assert found.trouble(late=5.0) == ""
    heard.now = 65.1
    assert found.trouble(late=5.0) == "no message on /scan for 5 s"


@pytest.fixture
def world(heard: Heard, monkeypatch: pytest.MonkeyPatch) -> RealtimeWorld:
    """A world whose services do nothing; it has a clock, and joint states at once."""
    joints = {name: JointState(0.0, 0.0, 0.0) for name in Scene([SEEING]).joints}
    states = SimpleNamespace(time=7.5, forget_unless_at=lambda _: None, wait_until=lambda _: (7.52, joints))
    idle = SimpleNamespace(
        wait=lambda: None, publish=lambda _: None, join=lambda _: None,
        claim=lambda _: None, check_holder=lambda _: None,
    )  # fmt: skip
    answer = SimpleNamespace(success=True)
    monkeypatch.setattr(realtime, "RunningSimulator", contextlib.nullcontext)
    monkeypatch.setattr(realtime, "SimulatorService", lambda *_: lambda *_: answer)
    monkeypatch.setattr(realtime, "CommandTopic", lambda *_: idle)
    monkeypatch.setattr(realtime, "JointStates", lambda _: states)
    monkeypatch.setattr(realtime, "time", SimpleNamespace(monotonic=lambda: heard.now))
    return RealtimeWorld(Scene([SEEING]), 0.02, cast(SharedWorld, idle))


def test_a_world_that_stood_paused_while_a_policy_learned_goes_on(
    heard: Heard, world: RealtimeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    world.look(StateQuery(sensors=("front_laser",)))
    listening = world._sensors
    scan = LaserScan(header=HEADER, ranges=[0.5])
    monkeypatch.setattr(listening, "wait", lambda _: heard.send("/scan", scan) or True)
    world.reset(InitialState())
    heard.now = 60.0
    assert world.act({}).sensors["front_laser"].ranges.tolist() == [0.5]
    heard.now = 65.1
    with pytest.raises(SimulatorError, match="no message on /scan for 5 s"):
        world.act({})


def test_after_a_reset_the_fault_of_messages_is_told_first(heard, world, monkeypatch) -> None:
    world.look(StateQuery(sensors=("front_laser", "camera")))
    strange = picture("yuv422", np.zeros((2, 2, 2), np.uint8))
    monkeypatch.setattr(world._sensors, "forget", lambda: heard.send("/eye/image_raw", strange))
    monkeypatch.setattr(world._sensors, "wait", lambda _: False)
    with pytest.raises(SimulatorError, match="^the sensor 'camera': pictures are yuv422"):
        world.reset(InitialState())


def test_old_and_repeated_readings_are_no_arrivals(heard: Heard) -> None:
    found = SensorListener(SEEING, ("front_laser",), lambda: heard.now, off=1.0)
    heard.now = 7.6
    heard.send("/scan", LaserScan(header=HEADER, ranges=[float("nan")]))
    heard.now = 7.8
    heard.send("/scan", LaserScan(header=HEADER, ranges=[0.2]))
    assert found.trouble(late=0.1) == "no message on /scan for 0.1 s"
    heard.now = 107.5
    heard.send("/scan", LaserScan(header=HEADER, ranges=[0.2]))
    assert "'front_laser': stamps are 100.0 s off the clock" in found.trouble(late=0.1)
    heard.send("/scan", LaserScan(header=Header(stamp=rospy.Time(107, 400_000_000))))
    assert found.trouble(late=0.1) == ""
    heard.now = 8.0  # time has gone back
    found.forget()
    heard.send("/scan", LaserScan(header=HEADER))
    assert found.trouble(late=0.1) == "" and found.missing() == []


def test_an_imu_that_reports_no_numbers_is_told(heard: Heard) -> None:
    found = listener(heard, "imu")
    broken = Imu(header=HEADER)
    broken.angular_velocity.y = float("nan")
    heard.send("/imu", broken)
    assert found.fault() == "the sensor 'imu': angular_velocity is [0.0, nan, 0.0]"
    assert found.missing() == ["/imu"]


def test_late_and_unreadable_messages_are_told(heard: Heard) -> None:
    found = listener(heard, "front_laser", "camera")
    heard.send("/scan", LaserScan(header=HEADER, ranges=[0.1]))
    heard.send("/eye/image_raw", picture("rgb8", np.zeros((2, 2, 3), np.uint8)))
    heard.now = 0.05
    assert found.trouble(late=0.01) == ""  # three periods of 50 Hz haven't passed
    heard.now = 0.07
    assert found.trouble(late=0.01) == "no message on /scan for 0.06 s"
    assert found.trouble(late=0.1) == ""
    heard.send("/eye/image_raw", picture("yuv422", np.zeros((2, 2, 2), np.uint8)))
    assert found.trouble(late=0.1).startswith("the sensor 'camera': pictures are yuv422; rgb8, ")
    heard.send("/eye/image_raw", picture("rgb8", np.zeros((2, 2, 3), np.uint8)))
    assert found.trouble(late=0.1) == ""
    found.forget()
    assert found.missing() == ["/scan", "/eye/image_raw"]
