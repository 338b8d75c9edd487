#!/usr/bin/env python3
"""A bag's pictures, joints and scans become a recording for Rerun's viewer, along simulated time.

    ./ws python3 -m pip install rerun-sdk
    ./ws python3 examples/to_rerun.py run.bag run.rrd
    ./ws rerun run.rrd

Scans are in their sensor's frame; other messages are left out.
"""

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import rerun as rr
import rosbag

COLOURS = {"rgb8": "RGB", "bgr8": "BGR", "mono8": "L"}
DEPTHS = {"16UC1": (np.uint16, 1000.0), "32FC1": (np.float32, 1.0)}  # units in a metre


def shown(message: Any) -> Iterator[tuple[str, Any]]:
    """Yields names below the topic, each with what Rerun shows there; nothing for other types."""
    kind = message._type
    if kind == "sensor_msgs/Image" and message.encoding in {**COLOURS, **DEPTHS}:
        number, units = DEPTHS.get(message.encoding, (np.uint8, None))
        picture = np.frombuffer(message.data, number).reshape(message.height, message.width, -1)
        colours = COLOURS.get(message.encoding)
        yield "", rr.DepthImage(picture, meter=units) if units else rr.Image(picture, colours)
    elif kind == "sensor_msgs/CompressedImage":
        media = "image/png" if "png" in message.format else "image/jpeg"
        yield "", rr.EncodedImage(contents=message.data, media_type=media)
    elif kind == "sensor_msgs/JointState":
        for quantity in ("position", "velocity", "effort"):
            for name, value in zip(message.name, getattr(message, quantity), strict=False):  # may be empty
                yield f"/{quantity}/{name}", rr.Scalars(value)
    elif kind == "sensor_msgs/LaserScan":
        ranges = np.asarray(message.ranges)
        angles = message.angle_min + message.angle_increment * np.arange(ranges.size)
        points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0.0 * angles], axis=1)
        yield "", rr.Points3D(points[np.isfinite(ranges)], radii=0.02)


def main() -> None:
    source, target = sys.argv[1:]
    rr.init("bag", strict=True)
    rr.save(target)
    with rosbag.Bag(source) as bag:
        for topic, message, _ in bag.read_messages():
            for name, content in shown(message):
                rr.set_time("time", duration=message.header.stamp.to_sec())
                rr.log(topic + name, content)


if __name__ == "__main__":
    main()
