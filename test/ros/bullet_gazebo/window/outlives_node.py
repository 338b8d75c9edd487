#!/usr/bin/env python3
"""The window survives killed simulators, pages that leave or stop reading, and other windows."""

import contextlib
import subprocess
import time
import unittest
from importlib.metadata import version

import msgspec
import rosnode
import rospy
import rostest
import zstandard
from support.pages.browser import BOUND, Output, wait_for
from support.pages.window_page import INERTIAL
from support.ros.calls import spawn_model
from websockets.sync.client import connect

HEADER = 16  # [bytes] in front of what viser sends: its lengths
BALL = f"""<robot name="ball"><link name="ball">{INERTIAL}
<visual><geometry><sphere radius="0.2"/></geometry></visual></link></robot>"""
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1.0, 0.0, 0.0, 0.0], "position": [3.0, 0.0, 1.0], "fov": 1.0,
    "near": 0.01, "far": 1000.0, "image_height": 600, "image_width": 800, "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0],
}  # fmt: skip


class Page:
    """What a browser is told; draws nothing."""

    def __init__(self, url):
        protocol = f"viser-v{version('viser')}"
        self._socket = connect(url.replace("http:", "ws:"), subprotocols=[protocol], max_size=None)
        self._socket.send(msgspec.msgpack.encode(CAMERA))

    def close(self):
        self._socket.close()

    def wait_for(self, *texts):
        """Waits for a message with all of these texts."""
        deadline = time.monotonic() + BOUND
        while time.monotonic() < deadline:
            content = self._socket.recv(timeout=BOUND)
            length = int.from_bytes(content[8:HEADER], "little")
            told = zstandard.ZstdDecompressor().decompress(content[HEADER : HEADER + length])
            for message in msgspec.msgpack.decode(told)["messages"]:
                if all(text in repr(message) for text in texts):
                    return
        raise AssertionError(f"no message with {texts} in {BOUND:g} s")


@contextlib.contextmanager
def simulator():
    process = subprocess.Popen(
        ["rosrun", "gazebo_ros", "gzserver"], stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT
    )
    try:
        yield
    finally:
        process.kill()
        process.wait(BOUND)


def spawn(name):
    def spawned():
        with contextlib.suppress(rospy.ServiceException):  # the killed one may be listed yet
            return spawn_model(name, BALL, "").success

    wait_for(spawned, f"model {name}")


class OutlivesTest(unittest.TestCase):
    def test_a_simulator_is_killed_and_another_one_comes(self):
        with simulator():
            window = Output("rosrun", "gazebo_ros", "gzclient", "--no-browser")
            self.addCleanup(window.close)
            page = Page(window.url)
            self.addCleanup(page.close)
            page.wait_for("real-time factor")
            spawn("first")
            page.wait_for("BatchedMeshesMessage")
            page.wait_for("<td>first")
            another = Output("rosrun", "gazebo_ros", "gzclient", "--no-browser")
            self.addCleanup(another.close)
            another_page = Page(another.url)
            self.addCleanup(another_page.close)
            another_page.wait_for("<td>first")  # and the first one goes on below
            self.assertEqual(sum("gazebo_gui" in name for name in rosnode.get_node_names()), 2)
        page.wait_for("no simulator /gazebo")
        stuck = [Page(window.url) for _ in range(10)]  # they take nothing of what is sent
        with simulator():
            page.wait_for("real-time factor")
            spawn("second")
            page.wait_for("<td>second")
            for each in stuck:
                each.close()
            spawn("third")
            page.wait_for("<td>second", "<td>third")


if __name__ == "__main__":
    rospy.init_node("outlives_test")
    rostest.rosrun("cartpole", "outlives", OutlivesTest)
