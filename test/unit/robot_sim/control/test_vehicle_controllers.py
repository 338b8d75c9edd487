"""Controllers of vehicles on both engines: motion, odometry, limits, time-outs, resets, parameters."""

from __future__ import annotations

import math
from typing import Any
from xml.etree.ElementTree import fromstring

import pytest
from support.robots.vehicles import RADIUS, TRACK, WHEELBASE, bicycle, four_wheels, two_wheels
from support.robots.worlds import add_robot, start

from robot_sim.control.controllers import built_in
from robot_sim.control.errors import ControlError
from robot_sim.physics.pose import Pose, to_rpy
from robot_sim.simulator import Simulator

MS = 1_000_000
DIFF: dict[str, Any] = {
    "type": "diff_drive_controller/DiffDriveController",
    "left_wheel": "left_joint",
    "right_wheel": ["right_joint"],
    "pose_covariance_diagonal": [0.001, 0.001, 1000, 1000, 1000, 0.03],
    "twist_covariance_diagonal": [0.001, 0.001, 0.001, 0.001, 0.001, 0.03],
}


class Track:
    """A simulator with a vehicle and its controller, whose outputs come into `sent`."""

    def __init__(self, world: Any, urdf: str, params: dict[str, Any], **options: Any) -> None:
        self.sim = Simulator(world, lockstep=True, **options)
        self.robot = add_robot(self.sim, "bot", urdf, Pose((0.0, 0.0, RADIUS)))
        self.model = self.robot.model
        start(self.robot, {"base": params})
        self.controller: Any = self.robot.manager.get("base")
        self.sent: dict[str, list[Any]] = {}
        for output in self.controller.outputs:
            output.sink = self.sent.setdefault(output.topic, []).append

    def advance(self, ticks: int, *command: float) -> None:
        """Advances; a command of ahead, left, turn is repeated as a client does."""
        for first in range(0, ticks, 100):
            if command:
                self.controller.command(command)
            self.sim.advance(min(100, ticks - first))

    @property
    def place(self) -> tuple[float, float, float]:
        pose = self.model.state()[0]
        return (*pose.position[:2], to_rpy(pose.orientation)[2])

    def stamps(self) -> list[int]:
        return [sample.stamp // MS for sample in self.sent["odom"]]


def test_a_vehicle_drives_and_its_odometry_says_where_it_is(world):
    track = Track(world, two_wheels(), DIFF)
    track.advance(5000, 0.2, 0.0, 0.0)
    assert track.place == pytest.approx((1.0, 0.0, 0.0), abs=0.02)
    track.advance(round(1000 * math.pi), 0.0, 0.0, 0.5)
    assert track.place[2] == pytest.approx(math.pi / 2.0, rel=0.03)
    sample = track.sent["odom"][-1]
    assert sample.position[:2] == pytest.approx(track.place[:2], abs=0.03)
    assert (sample.frame, sample.child) == ("odom", "base_link")
    assert sample.angular[2] == pytest.approx(0.5, abs=0.01)
    assert sample.pose_covariance[3] == 1000.0
    assert track.sent["/tf"][-1] == sample
    assert track.stamps()[:3] == [21, 41, 61]


def test_an_old_command_counts_as_rest(world):
    track = Track(world, two_wheels(), DIFF | {"cmd_vel_timeout": 0.25})
    track.controller.command((0.3, 0.0, 0.0))
    wheel = track.robot.hardware.joints["left_joint"]
    track.advance(250)
    assert wheel.command == pytest.approx(0.3 / RADIUS)
    track.advance(2)
    assert wheel.command == 0.0


def test_commands_are_limited_and_told(world):
    limits = {"has_velocity_limits": True, "max_velocity": 0.5,
              "has_acceleration_limits": True, "max_acceleration": 1, "min_acceleration": -2.0}  # fmt: skip
    params = {"linear": {"x": limits}, "publish_cmd": True,
              "publish_wheel_joint_controller_state": True}  # fmt: skip
    track = Track(world, two_wheels(), DIFF | params)
    track.advance(300, 3.0, 0.0, 0.0)
    speeds = [each.linear for each in track.sent["cmd_vel_out"]]
    assert speeds == pytest.approx([0.001 * (tick + 1) for tick in range(300)])
    state = track.sent["wheel_joint_controller_state"][-1]
    assert state.names == ("left_joint", "right_joint")
    assert state.desired[1] == pytest.approx((0.3 / RADIUS,) * 2)
    track.advance(500, 3.0, 0.0, 0.0)
    assert track.sent["cmd_vel_out"][-1].linear == 0.5
    track.advance(100, -1.0, 0.0, 0.0)
    assert track.sent["cmd_vel_out"][-1].linear == pytest.approx(0.3)


@pytest.mark.parametrize("reset", ["reset_simulation", "reset_world"])
def test_a_reset_brings_odometry_of_the_origin_at_once_and_no_jump_follows(world, reset):
    track = Track(world, two_wheels(), DIFF)
    track.advance(2000, 0.3, 0.0, 0.3)
    track.sent["odom"].clear()
    getattr(track.sim, reset)()
    begin = track.sim.now // MS
    track.advance(100)
    assert track.stamps() == [begin, *range(begin + 21, begin + 100, 20)]
    for sample in track.sent["odom"]:
        assert (*sample.position, *sample.linear) == pytest.approx((0.0,) * 6, abs=5e-3)


def test_a_world_that_keeps_controllers_keeps_odometry_that_does_not_fall_silent(world):
    track = Track(world, two_wheels(), DIFF, relatch=False)
    track.advance(2000, 0.3, 0.0, 0.0)
    track.sim.reset_time()
    track.sent["odom"].clear()
    track.advance(50)
    assert track.stamps()[0] <= 21
    assert track.sent["odom"][-1].position[0] == pytest.approx(0.6, abs=0.03)


def test_in_open_loop_the_commands_are_the_odometry(world):
    track = Track(world, two_wheels(), DIFF | {"open_loop": True, "enable_odom_tf": False})
    track.advance(1000, 0.2, 0.0, 0.1)
    assert track.sent["odom"][-1].linear == (0.2, 0.0, 0.0)
    assert track.sent["/tf"] == []


def test_radius_and_separation_come_from_the_description_or_parameters(world):
    given = {"wheel_separation": 2.0 * TRACK, "wheel_separation_multiplier": 0.5,
             "wheel_radius": 1, "wheel_radius_multiplier": RADIUS}  # fmt: skip
    for params in ({}, given):
        track = Track(world, two_wheels(), DIFF | params)
        track.controller.command((0.0, 0.0, 1.0))
        track.advance(1)
        joints, speed = track.robot.hardware.joints, 0.5 * TRACK / RADIUS
        assert joints["left_joint"].command == pytest.approx(-speed)
        assert joints["right_joint"].command == pytest.approx(speed)
        track.sim.remove_robot(track.robot)
        track.sim.delete_model(track.model)


def test_a_running_controller_is_tuned_at_once(world):
    params = {"wheel_separation_multiplier": 1.5, "publish_rate": 1.0}
    track = Track(world, two_wheels(), DIFF | params)
    track.advance(1100)
    values = {name: value for name, (value, _, _) in track.controller.tunables.items()}
    assert values["wheel_separation_multiplier"] == 1.5
    tuned = {"left_wheel_radius_multiplier": 0.5, "publish_rate": 50.0, "enable_odom_tf": False}
    track.controller.tune(values | tuned)
    track.sent["/tf"].clear()
    track.controller.command((0.1, 0.0, 0.0))
    track.advance(45)
    joints = track.robot.hardware.joints
    commands = [joints[f"{side}_joint"].command for side in ("left", "right")]
    assert commands == pytest.approx([2.0, 1.0])
    assert track.stamps() == [1001, 1121, 1141]
    assert track.sent["/tf"] == []


def test_wrong_commands_are_refused(world):
    track = Track(world, two_wheels(), DIFF | {"allow_multiple_cmd_vel_publishers": False})
    with pytest.raises(ControlError, match="not finite"):
        track.controller.command((math.nan, 0.0, 0.0))
    track.controller.cmd_vel.publishers = lambda: 2
    with pytest.raises(ControlError, match="more than one publisher"):
        track.controller.command((0.1, 0.0, 0.0))
    track.robot.manager.switch([], ["base"])
    with pytest.raises(ControlError, match="not running"):
        track.controller.command((0.1, 0.0, 0.0))


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"left_wheel": None}, "base/left_wheel must name a joint"),
        ({"left_wheel": ["left_joint", "right_joint"]}, "must have the same length"),
        ({"right_wheel": "no_joint"}, "joint 'no_joint' is not in"),
        ({"pose_covariance_diagonal": [1.0]}, "base/pose_covariance_diagonal must be a list of 6"),
        ({"wheel_radius": 0}, "base/wheel_radius must be above 0"),
        ({"wheel_separation_multiplier": -1}, "base/wheel_separation_multiplier must be above 0"),
        ({"wheel_radius_multiplier": 0.0}, "base/wheel_radius_multiplier must be above 0"),
        ({"left_wheel_radius_multiplier": 0}, "base/left_wheel_radius_multiplier must be above 0"),
        ({"right_wheel_radius_multiplier": -1}, "base/right_wheel_radius_multiplier must be above"),
        ({"open_loop": 1}, "base/open_loop must be of type bool"),
        ({"linear": {"x": {"has_jerk_limits": True}}}, "base/linear/x/max_jerk is missing"),
        ({"publish_rate": "fast"}, "base/publish_rate is missing or is not a finite number"),
    ],
)
def test_wrong_parameters_are_named(sim, wrong, complaint):
    robot = add_robot(sim, "bot", two_wheels())
    with pytest.raises(ControlError, match=complaint):
        built_in()[DIFF["type"]].create("base", DIFF | wrong, robot.hardware)


def test_a_description_without_a_distance_and_a_bicycle_of_no_length_are_refused(sim):
    bike = add_robot(sim, "bike", bicycle())
    for key in ("wheel_separation_h_multiplier", "wheel_radius_multiplier"):
        for value in (0.0, -1.0):
            with pytest.raises(ControlError, match=f"base/{key} must be above 0"):
                built_in()[ACKERMANN["type"]].create("base", ACKERMANN | {key: value}, bike.hardware)
    robot = add_robot(sim, "bot", two_wheels())
    description, create = robot.hardware.robot, built_in()[DIFF["type"]].create
    description.find("joint[@name='left_joint']/origin").set("xyz", "nan 0 0")
    with pytest.raises(ControlError, match="base/wheel_separation must be above 0 and finite"):
        create("base", DIFF, robot.hardware)
    back = '<joint name="back"><parent link="left_wheel"/><child link="base"/></joint>'
    description.append(fromstring(back))
    with pytest.raises(ControlError, match="the joints above 'left_joint' form a loop"):
        create("base", DIFF, robot.hardware)


COVARIANCES = {key: DIFF[key] for key in DIFF if "covariance" in key}
ACKERMANN = COVARIANCES | {
    "type": "ackermann_steering_controller/AckermannSteeringController",
    "rear_wheel": "rear_joint",
    "front_steer": "front_steering",
}
CORNERS = [f"{side}_{end}" for end in ("front", "rear") for side in ("left", "right")]
FOUR = COVARIANCES | {
    "type": "four_wheel_steering_controller/FourWheelSteeringController",
    "front_wheel": ["left_front_joint", "right_front_joint"],
    "rear_wheel": ["left_rear_joint", "right_rear_joint"],
    "front_steering": ["left_front_steering", "right_front_steering"],
    "rear_steering": ["left_rear_steering", "right_rear_steering"],
}


def test_a_bicycle_follows_the_circle_of_its_fork(world):
    track = Track(world, bicycle(), ACKERMANN)
    assert track.robot.manager.loaded[0].claims == {
        "VelocityJointInterface": ("rear_joint",),
        "PositionJointInterface": ("front_steering",),
    }
    track.advance(1000, 0.2, 0.0, 0.4)
    before = track.place[2]
    track.advance(4000, 0.2, 0.0, 0.4)
    rate = 0.2 * math.tan(0.4) / WHEELBASE
    assert track.place[2] - before == pytest.approx(4.0 * rate, rel=0.05)
    sample = track.sent["odom"][-1]
    assert sample.angular[2] == pytest.approx(rate, rel=0.02)
    x, y, yaw = track.place
    half = 0.5 * WHEELBASE  # the odometry is that of the rear wheel
    rear = (x - half * math.cos(yaw) + half, y - half * math.sin(yaw))
    assert sample.position[:2] == pytest.approx(rear, abs=0.05)


def test_four_steered_wheels_turn_round_their_centre_and_go_crabwise(world):
    track = Track(world, four_wheels(steered=tuple(CORNERS)), FOUR)
    track.advance(1000, 0.2, 0.0, 0.3)
    before = track.place[2]
    track.advance(1500, 0.2, 0.0, 0.3)
    assert track.place[2] - before == pytest.approx(0.45, rel=0.05)
    sample = track.sent["odom"][-1]
    assert (sample.linear[0], sample.angular[2]) == pytest.approx((0.2, 0.3), abs=0.01)
    assert sample.position[:2] == pytest.approx(track.place[:2], abs=0.05)
    for rear, steps in ((-0.2, 6), (0.3, 20)):
        track.sim.reset_simulation()
        for _ in range(steps):
            track.controller.command_axles((0.2, 0.3, rear))
            track.advance(100)
        steered = track.sent["odom_steer"][-1]
        assert (steered.front, steered.rear) == pytest.approx((0.3, rear), abs=0.01)
    x, y, yaw = track.place
    assert (y / x, yaw) == pytest.approx((math.tan(0.3), 0.0), abs=0.05)


def test_after_a_reset_axles_forget_their_commanded_angles(world):
    track = Track(world, four_wheels(steered=tuple(CORNERS)), FOUR)
    track.controller.command_axles((0.0, 0.4, -0.4))
    track.advance(100)
    fork = track.robot.hardware.joints["left_front_steering"]
    assert fork.command > 0.05
    track.sim.reset_simulation()
    track.advance(100)
    assert fork.command == 0.0
