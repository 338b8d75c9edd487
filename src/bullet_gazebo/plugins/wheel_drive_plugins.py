"""Gazebo's diff_drive, skid_steer_drive and tricycle_drive (docs/contract/sensors.md 1, 6 and 11)."""

import logging
import math

from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.common.messages import to_time
from bullet_gazebo.plugins.drive_topics import DrivePlugin, WheeledPlugin, Wheels, choice, length
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import MODEL, namespace_of
from robot_sim.drives.odometry import UNKNOWN, OdometrySample
from robot_sim.drives.wheels import Ramp, side_speeds
from robot_sim.physics.files.elements import truth

LEVELS = {"debug": 10, "info": 20, "warn": 30, "error": 40, "fatal": 50}
QUARTER = 0.5 * math.pi  # [rad]


class DiffDrivePlugin(WheeledPlugin):
    """Two wheels; a command holds until the next one or a reset."""

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context, namespace_of(context, MODEL, MODEL), context.rate("updateRate", 100.0))
        self._separation = length(context, "wheelSeparation", 0.34)
        self._wheels = Wheels(
            context,
            {"leftJoint": "left_joint", "rightJoint": "right_joint"},
            length(context, "wheelDiameter", 0.15),
            context.number("wheelTorque", 5.0),
        )
        self._ramp = Ramp(context.number("wheelAcceleration", 0.0), 2)
        self._joints = self._wheels.joints[::-1]  # the original's order is right, left
        self.measure_by(self._separation, [(each, each.child) for each in self._joints])
        level = LEVELS.get(context.text("rosDebugLevel", "").lower())
        if level is not None:
            # rospy's own debug lines are in the log that all share.
            logging.getLogger(f"rosout.{self.model.name}").setLevel(level)
        published = truth(context.text("publishTf", "true"))
        self.begin(odometry=published, tf=published and choice(context, "publishOdomTF", True))

    def wheel_speeds(self) -> list[float]:
        return self._wheels.speeds

    def drive(self, seconds: float) -> None:
        ahead, _, turn = self.command
        targets = side_speeds(ahead, turn, self._separation)
        self._wheels.drive(self._ramp.next(targets, self._wheels.speeds, seconds))

    def joint_state(self, now: int) -> JointState:
        names = [joint.name for joint in self._joints]
        positions = [self.model.joint_state(name)[0] for name in names]
        return JointState(header=Header(stamp=to_time(now)), name=names, position=positions)

    def restart(self) -> None:
        super().restart()
        self._ramp.restart()
        self._wheels.drive((0.0, 0.0))


class SkidSteerPlugin(DrivePlugin):
    """Two wheels on each side, which slip sideways in turns."""

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context, namespace_of(context, "", "/"), context.rate("updateRate", 100.0))
        self._separation = length(context, "wheelSeparation", 0.4)
        self._wheels = Wheels(
            context,
            {
                "leftFrontJoint": "left_front_joint",
                "leftRearJoint": "left_rear_joint",
                "rightFrontJoint": "right_front_joint",
                "rightRearJoint": "right_rear_joint",
            },
            length(context, "wheelDiameter", 0.15),
            context.number("torque", 5.0),
        )
        x, y, yaw = (
            context.number(f"covariance_{axis}", default)
            for axis, default in (("x", 1e-4), ("y", 1e-4), ("yaw", 1e-2))
        )
        self._covariance = (x, y, UNKNOWN, UNKNOWN, UNKNOWN, yaw)
        self.begin(tf=choice(context, "broadcastTF", default=False))

    def update(self, now: int) -> None:
        if self.period.is_over(now):
            self.report(now)
            self._drive()

    def _drive(self) -> None:
        ahead, _, turn = self.command
        left, right = side_speeds(ahead, turn, self._separation)
        self._wheels.drive((left, left, right, right))

    def restart(self) -> None:
        self._drive()

    def sample(self, now: int) -> OdometrySample:
        sample = self.truth(now, self._covariance, self._covariance)
        return sample._replace(position=(*sample.position[:2], 0.0))


class TricyclePlugin(WheeledPlugin):
    """A wheel that is driven and steered, and two that measure; a command turns it to an angle [rad]."""

    def __init__(self, context: PluginContext) -> None:
        namespace, rate = namespace_of(context, MODEL, MODEL), context.rate("updateRate", 100.0)
        super().__init__(context, namespace, rate, base="base_link")
        number, torque = context.number, context.number("wheelTorque", 5.0)
        self._steering = Wheels(context, {"steeringJoint": "front_steering_joint"}, 2.0, torque)
        wheel = {"actuatedWheelJoint": "front_wheel_joint"}
        self._wheel = Wheels(context, wheel, length(context, "actuatedWheelDiameter", 0.15), torque)
        encoders = {
            "encoderWheelLeftJoint": "left_wheel_joint",
            "encoderWheelRightJoint": "right_wheel_joint",
        }
        diameter = length(context, "encoderWheelDiameter", 0.15)
        self._encoders = Wheels(context, encoders, diameter, 0.0)
        self._acceleration = number("wheelAcceleration", 0.0)
        self._deceleration = number("wheelDeceleration", self._acceleration)
        self._tolerance = number("wheelSpeedTolerance", 0.01)  # [m/s]
        self._turning = number("steeringSpeed", 0.0)  # [rad/s]
        self._near = number("steeringAngleTolerance", 0.01)  # [rad]
        self._joints = self._steering.joints + self._wheel.joints + self._encoders.joints
        separation = length(context, "encoderWheelSeparation", 0.5)
        self.measure_by(separation, [(each, each.name) for each in self._joints])
        self.begin()

    def wheel_speeds(self) -> list[float]:
        return self._encoders.speeds[::-1]  # as in the original, which measures turns to the right

    def drive(self, seconds: float) -> None:
        ahead, _, angle = self.command
        self._wheel.drive([self._approached(ahead, seconds)])
        self._steer(max(-QUARTER, min(QUARTER, angle)))

    def _approached(self, target: float, seconds: float) -> float:
        """Returns the speed [m/s] on the way to `target` that the wheel may have after some seconds."""
        (speed,) = self._wheel.speeds
        gap = target - speed
        if self._acceleration <= 0.0 or abs(gap) < self._tolerance:
            return target
        brakes = abs(target) < abs(speed)
        most = seconds * (self._deceleration if brakes else self._acceleration)
        return speed + max(-most, min(most, gap))

    def _steer(self, target: float) -> None:
        """Turns the fork towards an angle [rad], or puts it there if it has no speed of its own."""
        name = self._steering.joints[0].name
        gap = target - self.model.joint_state(name)[0]
        turning = self._turning if abs(gap) > self._near else 0.0
        self._steering.drive([math.copysign(turning, gap)])
        if self._turning <= 0.0 and gap:
            self.model.body.reset_joint(self.model.joint_index(name), target)

    def joint_state(self, now: int) -> JointState:
        states = [self.model.joint_state(joint.name) for joint in self._joints]
        return JointState(
            Header(stamp=to_time(now)),
            [joint.name for joint in self._joints],
            [position for position, _ in states],
            [velocity for _, velocity in states],
            [0.0] * len(states),
        )

    def restart(self) -> None:
        super().restart()
        self._wheel.drive([0.0])
        self._steering.drive([0.0])


LIBRARIES = {
    "libgazebo_ros_diff_drive.so": DiffDrivePlugin,
    "libgazebo_ros_skid_steer_drive.so": SkidSteerPlugin,
    "libgazebo_ros_tricycle_drive.so": TricyclePlugin,
}
