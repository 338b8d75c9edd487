"""diff_drive_controller/DiffDriveController (docs/contract/sensors.md 7)."""

from collections.abc import Mapping
from typing import Any, Self

from robot_sim.control.controllers.base import Output
from robot_sim.control.controllers.parameters import parameter, positive, wheel_names
from robot_sim.control.controllers.vehicle import VehicleController, VehicleParameters
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import VELOCITY, RobotHardware
from robot_sim.control.joint import JointHandle
from robot_sim.control.trajectory_goals import TrajectorySample
from robot_sim.control.transmissions import distance, wheel_radius
from robot_sim.drives.odometry import Triple
from robot_sim.drives.wheels import side_speeds
from robot_sim.state_dict import Stateful

LEFT, RIGHT = "left_wheel_radius_multiplier", "right_wheel_radius_multiplier"
SEPARATION = "wheel_separation_multiplier"


class DiffDriveParameters(VehicleParameters):
    left_wheel: list[str] = parameter("a joint, or a list", read=wheel_names)
    right_wheel: list[str] = parameter("a joint, or a list", read=wheel_names)
    wheel_separation: float | None = parameter("[m]; else the description's", None, positive)
    wheel_radius: float | None = parameter("[m]; else the description's", None, positive)
    wheel_separation_multiplier: float = parameter("of the separation", 1.0, positive)
    wheel_radius_multiplier: float = parameter("of both radii", 1.0, positive)
    left_wheel_radius_multiplier: float | None = parameter("else that of both", None, positive)
    right_wheel_radius_multiplier: float | None = parameter("else that of both", None, positive)
    publish_wheel_joint_controller_state: bool = parameter(
        "whether `wheel_joint_controller_state` is published", False
    )


class Side(Stateful):
    """The wheels of one side, all of one radius [m]."""

    def __init__(self, joints: list[JointHandle], radius: float) -> None:
        self.joints = joints
        self.radius = radius
        self._turned = 0.0

    def travel(self) -> float:
        """Returns how far they have rolled since the last call, in the mean [m]."""
        turned = sum([joint.position for joint in self.joints]) / len(self.joints)
        last, self._turned = self._turned, turned
        return self.radius * (turned - last)

    def drive(self, speed: float) -> None:
        """Sets the speed of the rims [m/s]."""
        for joint in self.joints:
            joint.command = speed / self.radius


class DiffDriveController(VehicleController):
    """Wheels on the left and on the right."""

    parameters = (DiffDriveParameters,)

    def __init__(
        self, name: str, options: VehicleParameters, sides: tuple[Side, Side], separation: float,
        scales: Mapping[str, float],
    ) -> None:  # fmt: skip
        super().__init__(name, options)
        self._left, self._right = sides
        self._measures = (sides[0].radius, sides[1].radius, separation)  # before multipliers
        self._rescale(scales)
        self.tunables = {key: (scale, min(scale, 0.5), max(scale, 1.5)) for key, scale in scales.items()}
        self.tunables["publish_rate"] = (options.publish_rate, 0.0, 2000.0)
        self.tunables["enable_odom_tf"] = (options.enable_odom_tf, False, True)
        self._joints = sides[0].joints + sides[1].joints
        self.claimed = tuple(sorted(joint.name for joint in self._joints))
        self._wheels = Output("wheel_joint_controller_state", "TrajectorySample")

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        given, robot = DiffDriveParameters.read(params, name), hardware.robot
        sides = [
            [hardware.joint(VELOCITY, each) for each in names]
            for names in (given.left_wheel, given.right_wheel)
        ]
        if len(sides[0]) != len(sides[1]):
            raise ControlError(f"{name}/left_wheel and right_wheel must have the same length")
        first = given.left_wheel[0], given.right_wheel[0]
        separation = given.length("wheel_separation", name, lambda: distance(robot, *first))
        radius = given.length("wheel_radius", name, lambda: wheel_radius(robot, first[0]))
        both = given.wheel_radius_multiplier
        scales = {
            LEFT: given.left_wheel_radius_multiplier or both,
            RIGHT: given.right_wheel_radius_multiplier or both,
            SEPARATION: given.wheel_separation_multiplier,
        }
        left, right = (Side(joints, radius) for joints in sides)
        controller = cls(name, given, (left, right), separation, scales)
        if given.publish_wheel_joint_controller_state:
            controller.outputs.append(controller._wheels)
        return controller

    def _rescale(self, scales: Mapping[str, Any]) -> None:
        left, right, separation = self._measures
        self._left.radius, self._right.radius = left * scales[LEFT], right * scales[RIGHT]
        self._separation = separation * scales[SEPARATION]

    def tune(self, values: Mapping[str, Any]) -> None:
        self._rescale(values)
        self.period.set_rate(values["publish_rate"])
        self.period.time_set_back(self._now)  # a period that has begun may be a long one
        self.tf_on = values["enable_odom_tf"]

    def remember(self) -> None:
        self._left.travel()
        self._right.travel()

    def measure(self, dt: float) -> Triple:
        left, right = self._left.travel(), self._right.travel()
        return 0.5 * (left + right), 0.0, (right - left) / self._separation

    def drive(self, linear: float, angular: float) -> None:
        left, right = side_speeds(linear, angular, self._separation)
        self._left.drive(left)
        self._right.drive(right)

    def update(self, now: int, dt: float) -> None:
        super().update(now, dt)
        if self._wheels.wanted:
            self._wheels.send(self._wheel_state(now))

    def _wheel_state(self, now: int) -> TrajectorySample:
        """Returns the commanded and the measured speeds of the wheels, the left ones first."""
        positions, speeds, commands = (
            tuple(getattr(joint, part) for joint in self._joints)
            for part in ("position", "velocity", "command")
        )
        errors = tuple(a - b for a, b in zip(commands, speeds, strict=True))
        names = tuple(joint.name for joint in self._joints)
        return TrajectorySample(now, names, ((), commands, ()), (positions, speeds), ((), errors))


CONTROLLERS = {"diff_drive_controller/DiffDriveController": (DiffDriveController, VELOCITY)}
