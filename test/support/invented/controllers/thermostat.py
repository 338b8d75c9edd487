"""A controller that the software doesn't have: it turns a joint until a room is warm enough."""

from collections.abc import Mapping
from typing import Self

from robot_sim.control.controllers.base import Controller, Input
from robot_sim.control.controllers.parameters import OneJoint, parameter
from robot_sim.control.hardware import VELOCITY, RobotHardware
from robot_sim.control.joint import JointHandle


class ThermostatParameters(OneJoint):
    """Those of a valve."""

    slope: float = parameter("speed of the valve [rad/s/K]")
    room: float = parameter("temperature of the room [K]", 290.0)


class Thermostat(Controller):
    """Turns a valve by the lack of temperature."""

    parameters = (ThermostatParameters,)

    def __init__(self, name: str, joint: JointHandle, given: ThermostatParameters) -> None:
        super().__init__(name)
        self.joint, self.given, self.lack = joint, given, 0.0
        self.claimed = (joint.name,)
        self.inputs = [Input("command", "Temperature", self.command)]

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        given = ThermostatParameters.read(params, name)
        return cls(name, hardware.joint(cls.interface, given.joint), given)

    def command(self, temperature: float) -> None:
        self.lack = temperature - self.given.room

    def update(self, now: int, dt: float) -> None:
        self.joint.command = self.given.slope * self.lack


CONTROLLERS = {"invented_controllers/Thermostat": (Thermostat, VELOCITY)}
