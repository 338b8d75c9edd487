"""What all sensors of a world share: their schedule, what rays meet, and the seed of their noise."""

import numpy as np

from bullet_gazebo.physics.description import Sensor
from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.sensors.noise import generator
from bullet_gazebo.sensors.rays import RayScene
from bullet_gazebo.sensors.schedule import Schedule
from bullet_gazebo.simulator import Simulator


class Sensing:
    """The sensors of a simulator.

    Args:
        sim: the simulator.
        seed: of the sensors' noise.
    """

    def __init__(self, sim: Simulator, seed: int = 0) -> None:
        self.schedule = Schedule(sim)
        self.collisions = RayScene(sim.world)
        self.visuals = RayScene(sim.world, visuals=True)
        self.schedule.prepare += [self.collisions.expire, self.visuals.expire]
        self._seed = seed
        self._seeded_at = 0  # the number of moves before
        self.seeds = 0  # how often it has got a seed since
        sim.reseeded.append(self._reseed)

    def _reseed(self, seed: int) -> None:
        """Draws the same noise from now on as after any other time with this seed."""
        self._seed, self._seeded_at = seed, self.schedule.moves
        self.seeds += 1

    def noise(self, model: Model, name: str, now: int) -> np.random.Generator:
        """Returns what draws the noise of the measurement at `now` [ns] by the sensor or plugin `name`."""
        return generator(self._seed, model.name, name, self.schedule.moves - self._seeded_at, now)

    def bias(self, model: Model, name: str) -> np.random.Generator:
        """Returns what draws its biases, once."""
        return generator(self._seed, model.name, name, "bias")


def sensor_pose(model: Model, sensor: Sensor) -> Pose:
    """Returns where a sensor is in the world."""
    return model.link_state(sensor.link)[0].compose(sensor.pose)
