"""Controllers of vehicles that steer (docs/contract/sensors.md 13).

ackermann_steering_controller and four_wheel_steering_controller.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from robot_sim.control.controllers.base import Input, Output, option
from robot_sim.control.controllers.vehicle import (
    VehicleController,
    VehicleOptions,
    length_param,
    multiplier_param,
    names_param,
)
from robot_sim.control.errors import ControlError
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


class SteeringController(VehicleController):
    """A vehicle with driven wheels and steered forks."""

    interface = VELOCITY
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

    type_name = "ackermann_steering_controller/AckermannSteeringController"

    def __init__(
        self, name: str, options: VehicleOptions, wheel: JointHandle, fork: JointHandle,
        base: float, radius: float,
    ) -> None:  # fmt: skip
        super().__init__(name, options)
        self.claim([wheel], [fork])
        self._base, self._radius = base, radius  # [m]
        self.scale_radius = self.scale_angle = 1.0  # of what is measured
        self._last_turned = 0.0

    @classmethod
    def create(
        cls, name: str, params: Mapping[str, object], hardware: RobotHardware
    ) -> "AckermannSteeringController":
        wheel = hardware.joint(VELOCITY, option(params, "rear_wheel", name, "rear_wheel_joint"))
        fork = hardware.joint(POSITION, option(params, "front_steer", name, "front_steer_joint"))
        base = length_param(
            params, "wheel_separation_h", name,
            lambda: distance(hardware.robot, wheel.name, fork.name),
        )  # fmt: skip
        radius = length_param(
            params, "wheel_radius", name, lambda: wheel_radius(hardware.robot, wheel.name)
        )
        base *= multiplier_param(params, "wheel_separation_h_multiplier", name)
        found = cls(name, VehicleOptions.read(params, name), wheel, fork, base, radius)
        found.scale_radius = multiplier_param(params, "wheel_radius_multiplier", name)
        found.scale_angle = option(params, "steer_pos_multiplier", name, 1.0)
        return found

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

    type_name = "four_wheel_steering_controller/FourWheelSteeringController"
    non_persistent = ("_geometry",)
    _angles: tuple[float, float] | None  # of the axles [rad], if they are commanded

    def __init__(
        self, name: str, options: VehicleOptions, joints: list[list[JointHandle]],
        geometry: SteeredWheels, radius: float,
    ) -> None:  # fmt: skip
        super().__init__(name, replace(options, odom_frame="odom"))
        self.claim([*joints[0], *joints[1]], [*joints[2], *joints[3]])
        self._geometry, self._radius = geometry, radius
        self._steer = Output("odom_steer", "SteeringSample", whole=True)
        self.outputs.append(self._steer)
        steering = Input("cmd_four_wheel_steering", "FourWheelSteering", self.command_axles)
        self.inputs.append(steering)

    @classmethod
    def create(
        cls, name: str, params: Mapping[str, object], hardware: RobotHardware
    ) -> "FourWheelSteeringController":
        joints = []
        for key in ("front_wheel", "rear_wheel", "front_steering", "rear_steering"):
            kind, names = VELOCITY if "wheel" in key else POSITION, names_param(params, key, name)
            if len(names) != 2:
                raise ControlError(f"parameter {name}/{key} must list two joints: {names!r}")
            joints.append([hardware.joint(kind, each) for each in names])
        (left, right), (rear, _), forks = joints[0], joints[1], joints[2]
        robot = hardware.robot
        between = distance(robot, left.name, right.name)
        offset = 0.5 * (between - distance(robot, forks[0].name, forks[1].name))
        offset = option(params, "wheel_steering_y_offset", name, offset)
        track = length_param(params, "track", name, lambda: between)
        base = length_param(
            params, "wheel_base", name, lambda: distance(robot, left.name, rear.name)
        )
        radius = length_param(params, "wheel_radius", name, lambda: wheel_radius(robot, left.name))
        geometry = SteeredWheels(base, track - 2.0 * offset, offset)
        return cls(name, VehicleOptions.read(params, name), joints, geometry, radius)

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
            found = self._geometry.steering(linear, 0.0, angular)
        else:
            front, rear = map(math.tan, self._angles)
            base = self._geometry.base
            found = self._geometry.steering(1.0, 0.5 * (front + rear), (front - rear) / base)
            found = Steering(tuple(linear * each for each in found.speeds), found.angles)
        for joint, speed in zip(self.wheels, found.speeds, strict=True):
            joint.command = speed / self._radius
        for joint, angle in zip(self.forks, found.angles, strict=True):
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
