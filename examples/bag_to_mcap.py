#!/usr/bin/env python3
"""A bag becomes an MCAP file, as Foxglove reads it, too.

    ./ws python3 -m pip install mcap
    ./ws python3 examples/bag_to_mcap.py run.bag run.mcap

The messages are the same to the byte, with their times and definitions.
"""

import sys

import rosbag
from mcap.writer import Writer

source, target = sys.argv[1:]
channels: dict[tuple[bytes, ...], int] = {}  # of each connection
with rosbag.Bag(source) as bag, open(target, "wb") as file:
    writer = Writer(file)
    writer.start("ros1")
    for topic, message, time, header in bag.read_messages(raw=True, return_connection_header=True):
        connection = tuple(header.values())
        kind, content, *_ = message
        if connection not in channels:
            schema = writer.register_schema(kind, "ros1msg", header["message_definition"])
            kept = header.keys() & {"callerid", "latching", "md5sum"}  # as MCAP's profile for ROS 1 says
            about = {name: header[name].decode() for name in sorted(kept)}
            channels[connection] = writer.register_channel(topic, "ros1", schema, about)
        writer.add_message(channels[connection], time.to_nsec(), content, time.to_nsec())
    writer.finish()
