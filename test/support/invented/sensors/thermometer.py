"""A sensor that the software doesn't have: how warm it is at a height."""

from typing import ClassVar

import numpy as np

from robot_sim.sensors.sensing import Field, Measurement, Mount, sensor_of, sensor_pose

LAPSE = 10.0  # [K/m], so that heights of a room show


class Thermometer(Measurement):
    """A temperature that falls with the height."""

    kinds = ("thermometer",)
    fields: ClassVar = {"temperature": Field("(1,) [K]", True)}

    def __init__(self, mount: Mount) -> None:
        super().__init__(mount)
        self._sensor = sensor_of(mount, self.kinds)
        self.rate = self._sensor.rate

    def values(self, now: int) -> dict[str, np.ndarray]:
        height = sensor_pose(self.mount.model, self._sensor).position[2]
        return {"temperature": np.array([300.0 - LAPSE * height])}


SENSORS = (Thermometer,)
