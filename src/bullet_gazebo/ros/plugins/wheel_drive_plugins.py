"""libgazebo_ros_diff_drive.so and libgazebo_ros_skid_steer_drive.so (docs/contract/sensors.md 1 and 6)."""

import logging

from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.drives.odometry import UNKNOWN, OdometrySample
from bullet_gazebo.drives.wheels import Ramp, side_speeds
from bullet_gazebo.physics.files.elements import truth
from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.ros.plugins.drive_topics import (
    DrivePlugin,
    WheeledPlugin,
    Wheels,
    choice,
    length,
)
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import MODEL, namespace_of

LEVELS = {"debug": 10, "info": 20, "warn": 30, "error": 40, "fatal": 50}


class DiffDrivePlugin(WheeledPlugin):
    """Two wheels; a command holds until the next one or a reset."""

    def __init__(self, context: PluginContext) -> None:
        super().__init__(
            context, namespace_of(context, MODEL, MODEL), context.rate("updateRate", 100.0)
        )
        self._separation = length(context, "wheelSeparation", 0.34)
        self._wheels = Wheels(
            context,
            {"leftJoint": "left_joint", "rightJoint": "right_joint"},
            length(context, "wheelDiameter", 0.15),
            context.number("wheelTorque", 5.0),
        )
        self._ramp = Ramp(context.number("wheelAcceleration", 0.0), 2)
        # The original's order is right, left.
        self._joints = self._wheels.joints[::-1]
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
        found = self.truth(now, self._covariance, self._covariance)
        return found._replace(position=(*found.position[:2], 0.0))


LIBRARIES = {
    "libgazebo_ros_diff_drive.so": DiffDrivePlugin,
    "libgazebo_ros_skid_steer_drive.so": SkidSteerPlugin,
}
