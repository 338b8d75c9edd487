"""Plugins of lasers: scans, points, the nearest range (docs/contract/sensors.md 2, 2b, 6a and 6f)."""

import math
from typing import Any

import numpy as np
from geometry_msgs.msg import Point32
from sensor_msgs.msg import ChannelFloat32, LaserScan, PointCloud, PointCloud2, PointField, Range
from std_msgs.msg import Header

from bullet_gazebo.common.messages import to_time
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import MODEL, SensorPlugin, TopicSource
from robot_sim.sensors.laser import LaserSensor, RangeSensor

KINDS = {"<f4": PointField.FLOAT32, "<u2": PointField.UINT16}
LAYOUT = {"x": "<f4", "y": "<f4", "z": "<f4", "intensity": "<f4", "ring": "<u2", "time": "<f4"}
POINT = np.dtype([*LAYOUT.items()])
FIELDS = [
    PointField(name, POINT.fields[name][1], KINDS[kind], 1)  # type: ignore[index]
    for name, kind in LAYOUT.items()
]


def read_scan(message: LaserScan) -> dict[str, np.ndarray]:
    """Returns what a scan says."""
    return {name: np.array(getattr(message, name), np.float32) for name in ("ranges", "intensities")}


def read_range(message: Range) -> dict[str, np.ndarray]:
    """Returns what a range says."""
    return {"ranges": np.array([message.range], np.float32)}


class LaserPlugin(SensorPlugin):
    """Publishes the scans of a laser."""

    source = TopicSource(LaserScan, "/world", MODEL, read=read_scan)
    measurement = LaserSensor
    default_frame = "/world"

    def topic_name(self) -> str:
        """Returns the name of the topic; "" for an empty element."""
        return str(self.context.plugin.element.findtext(self.source.tag, self.source.topic).strip())

    def header(self, now: int) -> Header:
        """Returns the header of a message at a time [ns]."""
        return Header(stamp=to_time(now), frame_id=self.frame)

    def measure(self, now: int) -> Any:
        laser, scan = self.sensor.laser, self.sensor.measure(now)
        return LaserScan(
            header=self.header(now),
            angle_min=laser.horizontal.low,
            angle_max=laser.horizontal.high,
            angle_increment=laser.horizontal.increment,
            range_min=laser.low,
            range_max=laser.high,
            ranges=scan.ranges.astype(np.float32).ravel(),
            intensities=scan.intensities.astype(np.float32).ravel(),
        )


class BlockLaserPlugin(LaserPlugin):
    """Publishes all rays' points and intensities; a ray that meets nothing ends at the largest range."""

    source = TopicSource(PointCloud, "/world")

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        self._deviation = context.deviation()

    def measure(self, now: int) -> PointCloud:
        laser, random = self.sensor.laser, self.context.random(now)
        scan = self.sensor.scan(random)
        ranges, intensities = np.minimum(scan.ranges, laser.high).ravel(), scan.intensities.ravel()
        with np.errstate(invalid="ignore"):  # inf * 0
            points = ranges[:, None] * laser.directions.reshape(-1, 3)
        if self._deviation:
            draws = random.normal(0.0, self._deviation, (len(ranges), 4))
            draws[~np.isfinite(ranges) | (ranges == laser.high)] = 0.0
            points, intensities = points + draws[:, :3], intensities + draws[:, 3]
        return PointCloud(
            header=self.header(now),
            points=[Point32(*point) for point in points.tolist()],
            channels=[ChannelFloat32("", intensities.tolist())],
        )


class RangePlugin(LaserPlugin):
    """Publishes the smallest range, at most the largest that the sensor measures."""

    source = TopicSource(Range, "/range", rate=("updateRate", 0.0), read=read_range)
    measurement = RangeSensor

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        self._is_sound = context.text("radiation", "infrared") == "ultrasound"
        self._field_of_view = context.number("fov", 0.05)

    def measure(self, now: int) -> Range:
        laser = self.sensor.laser
        return Range(
            header=self.header(now),
            radiation_type=Range.ULTRASOUND if self._is_sound else Range.INFRARED,
            field_of_view=self._field_of_view,
            min_range=laser.low,
            max_range=laser.high,
            range=self.sensor.nearest(now),
        )


class VelodynePlugin(LaserPlugin):
    """Publishes the points that lie within the range, column by column, the lowest ring first."""

    source = TopicSource(PointCloud2, "/points", empty="")

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        laser = self.sensor.laser
        self._low = max(context.number("min_range", 0.0), laser.low)
        self._high = min(context.number("max_range", math.inf), laser.high)
        self._least = context.number("min_intensity", -math.inf)
        self._deviation = context.deviation()
        self._rings = np.broadcast_to(
            np.arange(laser.vertical.readings), (laser.horizontal.readings, laser.vertical.readings)
        )

    def measure(self, now: int) -> PointCloud2:
        random = self.context.random(now)
        scan = self.sensor.scan(random)
        ranges, intensities = scan.ranges.T, scan.intensities.T
        seen = self._within(ranges) & (intensities >= self._least)
        if self._deviation:
            ranges = ranges + random.normal(0.0, self._deviation, ranges.shape)
            seen &= self._within(ranges)
        points = np.zeros(int(seen.sum()), POINT)
        directions = self.sensor.laser.directions.transpose(1, 0, 2)
        places = ranges[seen][:, None] * directions[seen]
        points["x"], points["y"], points["z"] = places.T
        points["intensity"], points["ring"] = intensities[seen], self._rings[seen]
        return PointCloud2(
            header=self.header(now), height=1, width=len(points), fields=FIELDS,
            point_step=POINT.itemsize, row_step=points.nbytes, data=points.tobytes(), is_dense=True,
        )  # fmt: skip

    def _within(self, ranges: np.ndarray) -> np.ndarray:
        return (self._low < ranges) & (ranges < self._high)


LIBRARIES = {
    "libgazebo_ros_laser.so": LaserPlugin,
    "libgazebo_ros_gpu_laser.so": LaserPlugin,
    "libgazebo_ros_block_laser.so": BlockLaserPlugin,
    "libgazebo_ros_range.so": RangePlugin,
    "libgazebo_ros_velodyne_laser.so": VelodynePlugin,
    "libgazebo_ros_velodyne_gpu_laser.so": VelodynePlugin,
}
