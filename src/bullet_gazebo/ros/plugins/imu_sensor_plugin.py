"""libgazebo_ros_imu_sensor.so: a sensor of type imu, which feels gravity (docs/contract/sensors.md 3a).

`frameName` is required. `topicName` (imu_data), `updateRateHZ` (1), `gaussianNoise` (0), `rpyOffset` and
`initialOrientationAsReference` (false) are read. The slower of the two rates counts.
"""

from sensor_msgs.msg import Imu as ImuMsg

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.files.elements import numbers, truth
from bullet_gazebo.physics.pose import conjugate, from_rpy, multiply
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    MODEL,
    SensorPlugin,
    SensorTopic,
    namespace_of,
    sensor_of,
    to_imu,
    topic_in,
)
from bullet_gazebo.sensors.imu import Imu, motion_of, with_noise
from bullet_gazebo.sensors.noise import Noise, read_noise

PARTS = ("angular_velocity", "linear_acceleration")


class ImuSensorPlugin(SensorPlugin):
    """Publishes what an IMU measures, in its own axes."""

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        self._sensor = sensor = sensor_of(context, ("imu",))
        self._frame = context.text("frameName", "").lstrip("/")
        if not self._frame:
            raise DescriptionError("<frameName> is missing")
        self._deviation = context.deviation()
        self._turn = from_rpy(*numbers(context.text("rpyOffset", "0 0 0"), "<rpyOffset>", 3))
        if truth(context.text("initialOrientationAsReference", "false")):
            start = motion_of(context.model, sensor.link, sensor.pose).pose.orientation
            self._turn = multiply(self._turn, conjugate(start))
        self._noise = [
            (part, axis, noise)
            for part in PARTS
            for axis, noise in enumerate(_noise_of(context, part))
            if noise is not None
        ]
        rates = [each for each in (context.number("updateRateHZ", 1.0), sensor.rate) if each > 0.0]
        name = topic_in(
            namespace_of(context, absent=MODEL, empty="/"), context.text("topicName", "imu_data")
        )
        rate = min(rates, default=0.0)
        self._imu = Imu(feels_gravity=True, rate=rate)
        SensorTopic(context, name, ImuMsg, rate, self._measure, at_once=False)

    def _measure(self, now: int) -> ImuMsg | None:
        context, sensor = self._context, self._sensor
        motion = motion_of(context.model, sensor.link, sensor.pose)
        gravity, moves = context.sim.world.gravity, context.sensing.schedule.moves
        sample = self._imu.measure(now, moves, motion, gravity)
        if sample is None:
            return None
        random = context.sensing.noise(context.model, context.key, now)
        sample = sample._replace(orientation=multiply(self._turn, sample.orientation))
        biases = context.sensing.bias(context.model, context.key) if self._noise else random
        for part, axis, noise in self._noise:
            values = list(getattr(sample, part))
            values[axis] = float(noise.applied(values[axis], noise.draw_bias(biases), random))
            sample = sample._replace(**{part: tuple(values)})
        return to_imu(
            with_noise(sample, self._deviation, random), now, self._frame, self._deviation
        )


def _noise_of(context: PluginContext, part: str) -> list[Noise | None]:
    assert context.sensor is not None
    parent = context.sensor.element.find(f"imu/{part}")
    axes = [None if parent is None else parent.find(axis) for axis in "xyz"]
    return [read_noise(axis, f"<imu>, <{part}>") for axis in axes]


LIBRARIES = {"libgazebo_ros_imu_sensor.so": ImuSensorPlugin}
