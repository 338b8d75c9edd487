"""libgazebo_ros_tricycle_drive.so (docs/contract/sensors.md 11)."""

import math

from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.ros.plugins.drive_topics import WheeledPlugin, Wheels, length
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import MODEL, namespace_of

QUARTER = 0.5 * math.pi  # [rad]


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


LIBRARIES = {"libgazebo_ros_tricycle_drive.so": TricyclePlugin}
