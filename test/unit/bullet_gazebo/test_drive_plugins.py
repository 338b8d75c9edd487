"""Vehicles' plugins on both engines, their topics caught: motion, odometry, times, resets."""

from __future__ import annotations

import logging
import math

import pytest
from support.robots.vehicles import (
    RADIUS,
    TRACK,
    WHEELBASE,
    four_wheels,
    three_balls,
    three_wheels,
    two_wheels,
)
from support.ros.track import Track

from bullet_gazebo.common.messages import from_pose_msg, from_twist_msg
from robot_sim.physics.model import AT_REST
from robot_sim.physics.pose import Pose, from_rpy, to_rpy

MS = 1_000_000
DIFF = {
    "leftJoint": "left_joint", "rightJoint": "right_joint", "wheelSeparation": TRACK,
    "wheelDiameter": 2.0 * RADIUS,
}  # fmt: skip


@pytest.fixture(params=[0.001, 0.002])
def fine_or_coarse(make_world, monkeypatch, request):
    return Track(make_world(ground=True, time_step=request.param), monkeypatch)


def diff_drive(**elements: object) -> str:
    return two_wheels(**{"libgazebo_ros_diff_drive.so": DIFF | elements})


def test_two_wheels_drive_straight_and_turn_as_commanded(fine_or_coarse):
    track = fine_or_coarse
    ticks = round(1.0 / track.sim.world.time_step)
    track.spawn(diff_drive())
    track.advance(ticks // 2)
    start = track.model.state()[0].position
    track.command(0.4, 0.0)
    track.advance(5 * ticks // 2)
    x, y, _ = track.model.state()[0].position
    assert (x - start[0], y) == pytest.approx((1.0, 0.0), abs=0.02)
    track.command(0.0, 2.0)
    assert track.turned(round(math.pi * ticks)) == pytest.approx(2.0 * math.pi, rel=0.03)


def test_a_circle_is_closed(track):
    track.spawn(diff_drive())
    track.advance(500)
    track.command(0.3, 1.0)
    assert track.turned(6300) == pytest.approx(6.3, rel=0.03)
    x, y, _ = track.model.state()[0].position
    assert math.hypot(x, y) < 0.03


def test_odometry_of_the_world_is_the_state_of_the_model(track):
    track.spawn(diff_drive(publishWheelTF="true", publishWheelJointState="1"))
    track.command(0.2, 0.5)
    track.advance(700)
    place = Pose((1.0, 2.0, 0.1), (0.0, 0.0, 0.6, 0.8))
    track.sim.place_model(track.model, place, ((0.1, 0.2, 0.0), (0.0, 0.0, 0.3)))
    odometry = track.messages["/odom"][-1]
    pose, (linear, angular) = track.model.state()
    found = from_pose_msg(odometry.pose.pose)
    assert found.position == pytest.approx(pose.position, abs=1e-9)
    assert found.orientation == pytest.approx(pose.orientation, abs=1e-9)
    (ahead, left, _), turn = from_twist_msg(odometry.twist.twist)
    yaw = to_rpy(pose.orientation)[2]
    assert ahead == pytest.approx(math.cos(yaw) * linear[0] + math.sin(yaw) * linear[1], abs=1e-9)
    assert left == pytest.approx(math.cos(yaw) * linear[1] - math.sin(yaw) * linear[0], abs=1e-9)
    assert turn == (0.0, 0.0, angular[2])
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_footprint")
    assert odometry.pose.covariance[::7] == [1e-5, 1e-5, 1e12, 1e12, 1e12, 1e-3]
    assert not any(odometry.twist.covariance)
    assert track.messages["/joint_states"][-1].name == ["right_joint", "left_joint"]
    transforms = [message.transforms[0] for message in track.messages["/tf"]]
    chain = [f"{each.header.frame_id} {each.child_frame_id}" for each in transforms]
    assert chain[:3] == ["odom base_footprint", "base right_wheel", "base left_wheel"]
    wheel = transforms[1].transform.translation
    assert (wheel.x, wheel.y, wheel.z) == pytest.approx((0.0, -0.5 * TRACK, 0.0), abs=1e-6)
    translation = transforms[-1].transform.translation
    assert (translation.x, translation.y) == pytest.approx(pose.position[:2], abs=1e-9)


def test_odometry_comes_after_11_ms_and_then_every_10_ms_also_after_resets(track):
    track.spawn(diff_drive())
    track.advance(100)
    assert track.stamps("/odom") == list(range(11, 100, 10))
    transforms = [message.transforms[0] for message in track.messages["/tf"]]
    assert track.stamps("/odom") == [each.header.stamp.to_nsec() // MS for each in transforms]
    for reset, begin in ((track.sim.reset_simulation, 0), (track.sim.reset_world, 25)):
        track.messages["/odom"].clear()
        reset()
        track.advance(25)
        assert track.stamps("/odom") == [begin, begin + 11, begin + 21]
    track.sim.reset_time()
    track.messages["/odom"].clear()
    track.advance(25)
    assert track.stamps("/odom") == [11, 21]


@pytest.mark.parametrize("reset", ["reset_simulation", "reset_world"])
def test_a_reset_stops_the_wheels_and_encoders_begin_again_without_a_jump(track, reset):
    track.spawn(diff_drive(odometrySource="encoder", wheelAcceleration=1.0))
    track.advance(300)
    track.command(0.3, 0.4)
    track.advance(2000)
    last = track.messages["/odom"][-1]
    assert last.twist.twist.linear.x == pytest.approx(0.3, abs=0.01)
    pose = track.model.state()[0].position
    found = last.pose.pose.position
    assert (found.x, found.y) == pytest.approx(pose[:2], abs=0.03)
    getattr(track.sim, reset)()
    track.messages["/odom"].clear()
    track.advance(1000)
    for message in track.messages["/odom"]:
        twist, place = message.twist.twist, message.pose.pose.position
        assert (twist.linear.x, place.x, place.y) == pytest.approx((0.0, 0.0, 0.0), abs=5e-3)
    track.command(-0.2, 0.0)
    track.advance(1000)
    assert track.messages["/odom"][-1].twist.twist.linear.x == pytest.approx(-0.2, abs=0.01)


def test_encoders_of_a_robot_spawned_late_begin_at_the_origin(track):
    track.advance(5000)
    track.spawn(diff_drive(odometrySource="encoder"))
    track.command(0.2, 0.0)
    track.advance(12)
    assert abs(track.messages["/odom"][0].pose.pose.position.x) < 1e-3


def test_wheels_accelerate_as_the_file_says(track):
    track.spawn(diff_drive(wheelAcceleration=0.5, updateRate=0))
    track.advance(300)
    track.command(0.4, 0.0)
    track.advance(400)
    speed = track.model.state()[1][0][0]
    assert speed == pytest.approx(0.2, abs=0.02)
    track.advance(1000)
    assert track.model.state()[1][0][0] == pytest.approx(0.4, abs=0.01)


def test_topics_lie_where_the_file_says(track):
    track.spawn(diff_drive(robotNamespace="", publishTf="false", rosDebugLevel="na"), "")
    assert set(track.topics) == {"/bot/cmd_vel"}
    assert track.messages == {}


def test_a_plugins_log_level_is_its_own(track):
    track.spawn(diff_drive(rosDebugLevel="Debug"))
    levels = [logging.getLogger(name).getEffectiveLevel() for name in ("rosout.bot", "rosout")]
    assert levels[0] == logging.DEBUG < levels[1]


@pytest.mark.parametrize("library", ["libgazebo_ros_skid_steer_drive.so", "libgazebo_ros_planar_move.so"])
def test_topics_lie_in_the_robots_namespace(track, library):
    elements = {"wheelSeparation": TRACK, "wheelDiameter": 2.0 * RADIUS, "broadcastTF": 1}
    track.spawn(four_wheels(**{library: elements}), "/rover")
    track.advance(100)
    assert set(track.topics) == {"/rover/cmd_vel"}
    assert set(track.messages) == {"/rover/odom", "/tf"}


LIBRARIES = {
    **{f"libgazebo_ros_{kind}_drive.so": "updateRate" for kind in ("diff", "skid_steer", "tricycle")},
    "libgazebo_ros_planar_move.so": "odometryRate",
    "libhector_gazebo_ros_force_based_move.so": "odometryRate",
    "libgazebo_ros_kobuki.so": "update_rate",
}


@pytest.mark.parametrize(
    ("library", "tag", "value", "complaint", "heard"),
    [
        ("libgazebo_ros_diff_drive.so", "leftJoint", "none", "no movable joint 'none'", False),
        ("libgazebo_ros_diff_drive.so", "wheelDiameter", 0, "must be above 0", False),
        ("libgazebo_ros_diff_drive.so", "odometrySource", "magic", "magic", True),
        ("libgazebo_ros_diff_drive.so", "publishOdomTF", "perhaps", "neither true nor false", True),
        *((library, tag, -1, "is -1", False) for library, tag in LIBRARIES.items()),
    ],
)
def test_a_fault_in_the_file_is_one_line(track, library, tag, value, complaint, heard):
    """It leaves the vehicle out, or the element."""
    track.spawn(two_wheels(**{library: DIFF | {tag: value}}))
    [line] = track.logged
    assert f"<{tag}>" in line and complaint in line
    assert bool(track.topics) == heard
    track.advance(20)


def test_a_command_that_is_not_finite_is_ignored(track):
    track.spawn(diff_drive())
    track.command(math.nan, 0.0)
    track.advance(100)
    assert "linear.x is nan" in track.logged[0]
    assert math.isfinite(track.model.state()[0].position[0])


def test_four_wheels_drive_straight_and_turn_by_slipping(track):
    elements = {"wheelSeparation": TRACK, "wheelDiameter": 2.0 * RADIUS, "torque": 20}
    track.spawn(four_wheels(**{"libgazebo_ros_skid_steer_drive.so": elements}))
    track.advance(500)
    track.command(0.4, 0.0)
    track.advance(2500)
    assert track.model.state()[0].position[0] == pytest.approx(1.0, abs=0.02)
    track.command(0.0, 1.0)
    assert 0.1 < track.turned(1000) < 1.0
    odometry = track.messages["/odom"][-1]
    assert odometry.pose.pose.position.z == 0.0
    assert odometry.pose.covariance[::7] == [1e-4, 1e-4, 1e12, 1e12, 1e12, 1e-2]
    assert "/tf" not in track.messages
    track.sim.reset_simulation()
    track.advance(100)
    assert track.stamps("/odom")[-1] == 91


@pytest.mark.parametrize("library", ["libgazebo_ros_planar_move.so", "libridgeback_ros_force_based_move.so"])
def test_a_body_is_moved_in_its_own_axes(track, library):
    elements = {"x_velocity_p_gain": 1000, "y_velocity_p_gain": 1000}
    track.spawn(three_balls(**{library: elements}))
    track.advance(300)
    turned = Pose((0.0, 0.0, RADIUS), from_rpy(0.0, 0.0, 1.0))
    track.sim.place_model(track.model, turned, AT_REST)
    track.messages["/odom"].clear()
    track.command(0.2, 0.0, y=0.1)
    track.advance(2000)
    x, y, _ = track.model.state()[0].position
    way = (0.4 * math.cos(1.0) - 0.2 * math.sin(1.0), 0.4 * math.sin(1.0) + 0.2 * math.cos(1.0))
    assert (x, y) == pytest.approx(way, abs=0.02)
    odometry = track.messages["/odom"][-1]
    linear = odometry.twist.twist.linear
    assert (linear.x, linear.y) == pytest.approx((0.2, 0.1), abs=0.02)
    assert track.stamps("/odom") == list(range(350, 2301, 50))
    track.command(0.0, 1.0)
    assert track.turned(1000) == pytest.approx(1.0, abs=0.1)
    track.sim.reset_simulation()
    track.advance(200)
    assert track.stamps("/odom")[-5:] == [0, 50, 100, 150, 200]
    assert track.model.state()[0].position[:2] == pytest.approx((0.0, 0.0), abs=0.01)


def test_a_planar_move_stops_after_its_time_out(track):
    track.spawn(two_wheels(**{"libgazebo_ros_planar_move.so": {"cmdTimeout": 0.2}}))
    track.advance(300)
    track.command(0.5, 0.0)
    track.advance(1000)
    assert track.model.state()[0].position[0] == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize("speed", [0, 1.0])
def test_a_tricycle_steers_by_its_front_wheel(track, speed):
    elements = {
        "steeringJoint": "front_steering", "actuatedWheelJoint": "front_joint",
        "encoderWheelLeftJoint": "left_joint", "encoderWheelRightJoint": "right_joint",
        "actuatedWheelDiameter": 2.0 * RADIUS, "encoderWheelDiameter": 2.0 * RADIUS,
        "wheelTorque": 20, "steeringSpeed": speed, "publishWheelJointState": "true",
        "publishWheelTF": "true", "odometrySource": "world",
    }  # fmt: skip
    track.spawn(three_wheels(**{"libgazebo_ros_tricycle_drive.so": elements}))
    track.advance(300)
    track.command(0.2, 0.0)
    track.advance(2000)
    assert track.model.state()[0].position[0] == pytest.approx(0.4, abs=0.03)
    angle = 0.5
    track.command(0.2, angle)
    track.advance(1000)
    turned = track.turned(1500)
    assert turned == pytest.approx(1.5 * 0.2 * math.sin(angle) / WHEELBASE, rel=0.1)
    state = track.messages["/joint_states"][-1]
    assert state.name == ["front_steering", "front_joint", "left_joint", "right_joint"]
    assert state.position[0] == pytest.approx(angle, abs=0.02)
    children = {message.transforms[0].child_frame_id for message in track.messages["/tf"]}
    assert children == {"base_link", *state.name}


def test_a_rate_near_zero_is_a_very_long_period(track):
    track.spawn(diff_drive(updateRate=1e-300))
    track.advance(50)
    assert not track.logged
    assert not track.messages["/odom"]
