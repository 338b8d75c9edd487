"""Controllers that report a robot's sensors, and drive nothing (docs/contract/sensors.md 13).

imu_sensor_controller and force_torque_sensor_controller.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any, ClassVar, NamedTuple, Self

from robot_sim.control.controllers.base import Controller, Output
from robot_sim.control.controllers.parameters import Parameters, parameter
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import FORCE_TORQUE, IMU, RobotHardware, SensorHandle
from robot_sim.drives.odometry import Period


class SensorSample(NamedTuple):
    """What a sensor has measured last, as a controller reports it."""

    stamp: int  # [ns]
    frame: str
    value: Any


class PublishRate(Parameters):
    publish_rate: float = parameter("[Hz of simulated time]; 0 publishes nothing")


class SensorController(Controller):
    """Publishes each sensor of a kind at `publish_rate` [Hz of simulated time], under the sensor's name."""

    parameters = (PublishRate,)
    sensors: ClassVar[str]  # what they are called in messages
    kind: ClassVar[str]  # of the outputs

    def __init__(self, name: str, handles: list[SensorHandle], rate: float) -> None:
        super().__init__(name)
        self._rate = rate
        self._period = Period(rate, 0, late=True)
        self._handles = [(each, Output(each.name, self.kind, shared=True, whole=True)) for each in handles]
        self.outputs = [output for _, output in self._handles]

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        given = PublishRate.read(params, name)
        handles = [make() for make in hardware.sensors[cls.interface]]
        if not handles:
            raise ControlError(
                f"the robot has no {cls.sensors}, and so no hardware_interface::{cls.interface}"
            )
        return cls(name, handles, given.publish_rate)

    def starting(self, now: int) -> None:
        self._period.restart(now)
        for handle, output in self._handles:
            handle.begin(partial(self._report, handle, output))

    def stopping(self) -> None:
        for handle, _ in self._handles:
            handle.end()

    def joints_moved(self, now: int) -> None:
        self._period.time_set_back(now)

    def update(self, now: int, dt: float) -> None:
        if self._rate > 0.0 and self._period.is_over(now):
            for handle, output in self._handles:
                self._report(handle, output, now)

    def _report(self, handle: SensorHandle, output: Output, now: int) -> None:
        if handle.value is not None and self._rate > 0.0 and output.wanted:
            output.send(SensorSample(now, handle.frame, handle.value))


class ImuSensorController(SensorController):
    """Reports the links' sensors of type imu."""

    sensors, kind = '<sensor type="imu">', "InertialSample"


class ForceTorqueSensorController(SensorController):
    """Reports the joints' sensors of type force_torque."""

    sensors, kind = '<sensor type="force_torque">', "Wrench"


CONTROLLERS = {
    "imu_sensor_controller/ImuSensorController": (ImuSensorController, IMU),
    "force_torque_sensor_controller/ForceTorqueSensorController": (ForceTorqueSensorController, FORCE_TORQUE),
}
