"""Controllers of vehicles that steer (docs/contract/sensors.md 13).

ackermann_steering_controller and four_wheel_steering_controller.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple, Self

from robot_sim.control.controllers.base import Input, Output
from robot_sim.control.controllers.parameters import number, parameter, positive, reader, wheel_names
from robot_sim.control.controllers.vehicle import VehicleController, VehicleParameters
from robot_sim.control.hardware import POSITION, VELOCITY, RobotHardware
from robot_sim.control.joint import JointHandle
from robot_sim.control.transmissions import distance, wheel_radius
from robot_sim.drives.odometry import Triple
from robot_sim.drives.wheels import SteeredWheels, Steering

STRAIGHT = 1e-6  # [rad]


class SteeringSample(NamedTuple):
    """four_wheel_steering_msgs/FourWheelSteering: angles of the axles [rad], speed [m/s]."""

    stamp: int  # [ns]
    front: float
    rear: float
    speed: float


_pair = reader(lambda value: len(value) == 2, "must list two joints", before=wheel_names)


class SteeringParameters(VehicleParameters):
    wheel_radius: float | None = parameter("[m]; else the description's", None, positive)


class AckermannParameters(SteeringParameters):
    rear_wheel: str = parameter("joint of the driven wheel", "rear_wheel_joint")
    front_steer: str = parameter("joint of the fork", "front_steer_joint")
    wheel_separation_h: float | None = parameter("[m]; else the description's", None, positive)
    wheel_separation_h_multiplier: float = parameter("of the separation", 1.0, positive)
    wheel_radius_multiplier: float = parameter("of the measured way", 1.0, positive)
    steer_pos_multiplier: float = parameter("of the measured angle", 1.0)


class FourWheelParameters(SteeringParameters):
    front_wheel: list[str] = parameter("two joints, the left one first", read=_pair)
    rear_wheel: list[str] = parameter("two joints, the left one first", read=_pair)
    front_steering: list[str] = parameter("two joints, the left one first", read=_pair)
    rear_steering: list[str] = parameter("two joints, the left one first", read=_pair)
    track: float | None = parameter("[m]; else the description's", None, positive)
    wheel_base: float | None = parameter("[m]; else the description's", None, positive)
    wheel_steering_y_offset: float | None = parameter("[m]; else the description's", None, number)


class SteeringController(VehicleController):
    """A vehicle with driven wheels and steered forks."""

    wheels: list[JointHandle]
    forks: list[JointHandle]

    def claim(self, wheels: list[JointHandle], forks: list[JointHandle]) -> None:
        """Takes the joints."""
        self.wheels, self.forks = wheels, forks
        self.claimed = tuple(sorted(joint.name for joint in (*wheels, *forks)))

    @property
    def claims(self) -> Mapping[str, tuple[str, ...]]:
        pairs = ((VELOCITY, self.wheels), (POSITION, self.forks))
        return {kind: tuple(sorted(joint.name for joint in group)) for kind, group in pairs}


class AckermannSteeringController(SteeringController):
    """One driven wheel behind, one steered fork before it; `angular.z` of a command is its angle [rad]."""

    parameters = (AckermannParameters,)

    def __init__(
        self, name: str, options: VehicleParameters, wheel: JointHandle, fork: JointHandle,
        base: float, radius: float,
    ) -> None:  # fmt: skip
        super().__init__(name, options)
        self.claim([wheel], [fork])
        self._base, self._radius = base, radius  # [m]
        self.scale_radius = self.scale_angle = 1.0  # of what is measured
        self._last_turned = 0.0

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        given, robot = AckermannParameters.read(params, name), hardware.robot
        wheel = hardware.joint(VELOCITY, given.rear_wheel)
        fork = hardware.joint(POSITION, given.front_steer)
        base = given.length("wheel_separation_h", name, lambda: distance(robot, wheel.name, fork.name))
        radius = given.length("wheel_radius", name, lambda: wheel_radius(robot, wheel.name))
        base *= given.wheel_separation_h_multiplier
        controller = cls(name, given, wheel, fork, base, radius)
        controller.scale_radius = given.wheel_radius_multiplier
        controller.scale_angle = given.steer_pos_multiplier
        return controller

    def remember(self) -> None:
        self._last_turned = self.wheels[0].position

    def measure(self, dt: float) -> Triple:
        turned = self.wheels[0].position
        ahead = (turned - self._last_turned) * self._radius * self.scale_radius
        self._last_turned = turned
        return ahead, 0.0, self.turn_of(ahead, self.forks[0].position * self.scale_angle)

    def turn_of(self, linear: float, angular: float) -> float:
        return math.tan(angular) * linear / self._base

    def drive(self, linear: float, angular: float) -> None:
        self.wheels[0].command = linear / self._radius
        self.forks[0].command = angular


class FourWheelSteeringController(SteeringController):
    """Four driven wheels on forks: front left, front right, rear left, rear right."""

    parameters = (FourWheelParameters,)
    non_persistent = ("_geometry",)
    _angles: tuple[float, float] | None  # of the axles [rad], if they are commanded

    def __init__(
        self, name: str, options: VehicleParameters, joints: list[list[JointHandle]],
        geometry: SteeredWheels, radius: float,
    ) -> None:  # fmt: skip
        super().__init__(name, replace(options, odom_frame_id="odom"))
        self.claim([*joints[0], *joints[1]], [*joints[2], *joints[3]])
        self._geometry, self._radius = geometry, radius
        self._steer = Output("odom_steer", "SteeringSample", whole=True)
        self.outputs.append(self._steer)
        steering = Input("cmd_four_wheel_steering", "FourWheelSteering", self.command_axles)
        self.inputs.append(steering)

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        given, robot = FourWheelParameters.read(params, name), hardware.robot
        groups = given.front_wheel, given.rear_wheel, given.front_steering, given.rear_steering
        kinds = VELOCITY, VELOCITY, POSITION, POSITION
        joints = [
            [hardware.joint(kind, each) for each in names] for kind, names in zip(kinds, groups, strict=True)
        ]
        (left, right), (rear, _), forks = groups[:3]
        between = distance(robot, left, right)
        offset = 0.5 * (between - distance(robot, *forks))
        if given.wheel_steering_y_offset is not None:
            offset = given.wheel_steering_y_offset
        track = given.length("track", name, lambda: between)
        base = given.length("wheel_base", name, lambda: distance(robot, left, rear))
        radius = given.length("wheel_radius", name, lambda: wheel_radius(robot, left))
        geometry = SteeredWheels(base, track - 2.0 * offset, offset)
        return cls(name, given, joints, geometry, radius)

    def _halt(self) -> None:
        super()._halt()
        self._angles = None

    def command(self, twist: Triple) -> None:
        super().command(twist)
        self._angles = None

    def command_axles(self, command: Triple) -> None:
        """Takes a speed [m/s] and the angles [rad] of the axles, front and rear."""
        self.check_command(command)
        speed, front, rear = command
        self._wanted, self._stamp = (speed, 0.0, 0.0), self._now
        self._angles = (front, rear)

    def remember(self) -> None:
        """Measures speeds, which have no past."""

    def measure(self, dt: float) -> Triple:
        speeds = tuple(joint.velocity * self._radius for joint in self.wheels)
        angles = tuple(joint.position for joint in self.forks)
        ahead, left, turn = self._geometry.velocity(Steering(speeds, angles))
        return ahead * dt, left * dt, turn * dt

    def drive(self, linear: float, angular: float) -> None:
        if self._angles is None or self.is_late(self._now):
            steering = self._geometry.steering(linear, 0.0, angular)
        else:
            front, rear = map(math.tan, self._angles)
            base = self._geometry.base
            steering = self._geometry.steering(1.0, 0.5 * (front + rear), (front - rear) / base)
            steering = Steering(tuple(linear * each for each in steering.speeds), steering.angles)
        for joint, speed in zip(self.wheels, steering.speeds, strict=True):
            joint.command = speed / self._radius
        for joint, angle in zip(self.forks, steering.angles, strict=True):
            joint.command = angle

    def report(self, now: int) -> None:
        super().report(now)
        if self._steer.wanted:
            angles = [joint.position for joint in self.forks]
            front, rear = axle_angle(*angles[:2]), axle_angle(*angles[2:])
            self._steer.send(SteeringSample(now, front, rear, self._velocity[0]))


def axle_angle(left: float, right: float) -> float:
    """Returns the angle [rad] in the middle of an axle whose wheels go round one centre."""
    one, other = math.tan(left), math.tan(right)
    both = one + other
    return math.atan(2.0 * one * other / both) if abs(both) > STRAIGHT else 0.0


CONTROLLERS = {
    "ackermann_steering_controller/AckermannSteeringController": (AckermannSteeringController, VELOCITY),
    "four_wheel_steering_controller/FourWheelSteeringController": (FourWheelSteeringController, VELOCITY),
}
