"""The base of TurtleBot 2 on both engines, its topics caught."""

import pytest
from kobuki_msgs.msg import BumperEvent, CliffEvent, MotorPower
from std_msgs.msg import Empty
from support.robots.vehicles import RADIUS, TRACK, two_wheels
from support.ros.silent_topics import SilentSubscriber

from bullet_gazebo.common.messages import from_pose_msg
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.model import AT_REST
from robot_sim.physics.pose import Pose, to_rpy

CLIFFS = {"left": (0.15, 0.1), "center": (0.16, 0.0), "right": (0.15, -0.1)}
KOBUKI = {
    "left_wheel_joint_name": "left_joint", "right_wheel_joint_name": "right_joint",
    "wheel_separation": TRACK, "wheel_diameter": 2.0 * RADIUS, "torque": 5.0,
    "velocity_command_timeout": 0.6, "cliff_detection_threshold": 0.12, "bumper_name": "bumpers",
    "imu_name": "imu", "publish_tf": 1, "update_rate": 50,
    **{f"cliff_sensor_{side}_name": f"cliff_{side}" for side in CLIFFS},
}  # fmt: skip
DROPS = {f"wheel_drop_{side}_sensor_name": f"drop_{side}" for side in ("left", "right")}
WALL = """<sdf version="1.6"><model name="wall"><static>1</static><link name="l"><collision name="c">
<geometry><box><size>0.1 0.2 1</size></box></geometry></collision></link></model></sdf>"""
RAY = "<ray><scan><horizontal><samples>1</samples></horizontal></scan>"
RAY += "<range><min>0.01</min><max>0.3</max></range></ray>"


def kobuki(**elements: object) -> str:
    """Two wheels with the sensors of a Kobuki."""
    text = two_wheels(**{"libgazebo_ros_kobuki.so": KOBUKI | elements})
    contact = "<contact><collision>base_collision</collision></contact>"
    sensors = f'<sensor name="bumpers" type="contact">{contact}</sensor>'
    sensors += '<sensor name="imu" type="imu"><update_rate>50</update_rate></sensor>'
    for side, (x, y) in CLIFFS.items():
        pose = f"<pose>{x} {y} 0 0 1.5707963 0</pose><update_rate>50</update_rate>"
        sensors += f'<sensor name="cliff_{side}" type="ray">{pose}{RAY}</sensor>'
    sensors = f'<gazebo reference="base">{sensors}</gazebo>'
    for side in ("left", "right"):
        contact = f"<contact><collision>{side}_wheel_collision</collision></contact>"
        drop = f'<sensor name="drop_{side}" type="contact">{contact}</sensor>'
        sensors += f'<gazebo reference="{side}_wheel">{drop}</gazebo>'
    return text.replace("</robot>", f"{sensors}</robot>")


def test_a_kobuki_drives_for_its_time_out_and_measures_itself(track):
    track.spawn(kobuki())
    track.advance(300)
    where = track.model.state()[0].position[0]
    upwards = track.messages["/mobile_base/sensors/imu_data"][-1].linear_acceleration.z
    assert upwards == pytest.approx(9.81, abs=0.2)
    track.command(0.2, 0.5, "/mobile_base/commands/velocity")
    track.advance(600)
    track.command(0.2, 0.5, "/mobile_base/commands/velocity")
    track.advance(580)
    own = from_pose_msg(track.messages["/odom"][-1].pose.pose)
    pose = track.model.state()[0]
    assert own.position[0] == pytest.approx(pose.position[0] - where, abs=0.01)
    assert to_rpy(own.orientation)[2] == pytest.approx(to_rpy(pose.orientation)[2], abs=0.02)
    track.advance(600)  # at rest but for the first of them
    odometry = track.messages["/odom"][-1]
    yaw = to_rpy(from_pose_msg(odometry.pose.pose).orientation)[2]
    assert yaw == pytest.approx(0.6, rel=0.05)
    assert odometry.twist.twist.linear.x == pytest.approx(0.0, abs=0.01)
    assert odometry.pose.covariance[::7] == [0.1, 0.1, 1e6, 1e6, 1e6, 0.05]
    assert track.stamps("/odom")[:3] == [20, 40, 60]
    SilentSubscriber.send("/mobile_base/commands/reset_odometry", Empty())
    track.advance(20)
    assert abs(track.messages["/odom"][-1].pose.pose.position.x) < 1e-3
    SilentSubscriber.send("/mobile_base/commands/motor_power", MotorPower(MotorPower.OFF))
    track.command(0.2, 0.0, "/mobile_base/commands/velocity")
    track.advance(500)
    assert track.messages["/odom"][-1].twist.twist.linear.x == pytest.approx(0.0, abs=0.01)


def test_a_kobuki_tells_of_bumps_and_cliffs_once(track):
    track.sim.world.spawn("wall", parse_sdf(WALL), Pose((0.35, 0.0, 0.5)))
    track.spawn(kobuki(**DROPS), height=RADIUS - 0.001)
    track.advance(300)
    events = ("bumper", "cliff", "wheel_drop")
    bumps, cliffs, drops = (track.messages[f"/mobile_base/events/{each}"] for each in events)
    assert bumps == cliffs == []
    assert not any(core.wheel_drop for core in track.messages["/mobile_base/sensors/core"][-5:])
    for _ in range(2):
        track.command(0.2, 0.0, "/mobile_base/commands/velocity")
        track.advance(500)
    assert bumps[0] == BumperEvent(BumperEvent.CENTER, BumperEvent.PRESSED)
    core = track.messages["/mobile_base/sensors/core"]
    assert 2 in {each.bumper for each in core}
    track.sim.place_model(track.model, Pose((0.0, 0.0, 1.0)), AT_REST)
    track.advance(25)
    assert bumps[-1] == BumperEvent(BumperEvent.CENTER, BumperEvent.RELEASED)
    assert [each.sensor for each in cliffs] == [0, 1, 2]
    assert {each.state for each in cliffs} == {CliffEvent.CLIFF}
    assert (core[-1].cliff, core[-1].wheel_drop) == (7, 3)
    assert {each.wheel: each.state for each in drops} == {0: 1, 1: 1}


def test_a_move_tells_nothing_of_bumpers_and_wheels_that_still_touch(track):
    track.spawn(kobuki(**DROPS), height=RADIUS - 0.001)
    track.advance(300)
    drops = track.messages["/mobile_base/events/wheel_drop"]
    drops.clear()
    track.sim.place_model(track.model, track.model.state()[0], AT_REST)
    track.advance(5)
    assert not drops


def test_a_kobuki_without_one_of_its_elements_or_sensors_is_left_out_with_a_line(track):
    track.spawn(kobuki(imu_name=""))
    assert track.logged[-1].endswith("<imu_name> is missing")
    track.sim.delete_model(track.model)
    track.spawn(kobuki(bumper_name="imu"))
    assert "<bumper_name>: the model has no sensor 'imu' of type contact" in track.logged[-1]
