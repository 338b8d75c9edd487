#!/usr/bin/env python3
"""respawn_gazebo and server_required of empty_world.launch, with a simulator that is killed."""

import os
import signal
import socket
import subprocess
import tempfile
import threading
import unittest
import xmlrpc.client

import rosgraph
import rostest

BOUND = 40.0  # [s]


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class World:
    """A world launched with arguments of the user's, on a master of its own."""

    def __init__(self, *args):
        self.log = tempfile.TemporaryFile()  # noqa: SIM115 - close() does
        port = free_port()
        self._master = rosgraph.Master("/launch_arguments", f"http://localhost:{port}")
        command = [
            "roslaunch",
            "-p",
            str(port),
            "gazebo_ros",
            "empty_world.launch",
            "gui:=false",
            *args,
        ]
        env = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{port}"}
        self.launch = subprocess.Popen(command, env=env, stdout=self.log, stderr=self.log)

    def simulator(self, unlike=None):
        """Process id of the simulator once it is up, and another one than `unlike`."""
        pause = threading.Event()
        for _ in range(int(BOUND / 0.1)):
            pid = self._pid()
            if pid not in (None, unlike):
                return pid
            pause.wait(0.1)
        raise AssertionError("no simulator came up")

    def _pid(self):
        try:
            uri = self._master.lookupNode("/gazebo")
            self._master.lookupService("/gazebo/pause_physics")
            return xmlrpc.client.ServerProxy(uri).getPid("/launch_arguments")[2]
        except (rosgraph.MasterException, OSError):
            return None

    def close(self):
        if self.launch.poll() is None:
            self.launch.send_signal(signal.SIGINT)
        self.launch.wait(BOUND)
        self.log.close()


class LaunchArgumentsTest(unittest.TestCase):
    def world(self, *args):
        world = World(*args)
        self.addCleanup(world.close)
        return world

    def test_respawn_gazebo_starts_a_killed_simulator_again(self):
        world = self.world("respawn_gazebo:=true")
        first = world.simulator()
        os.kill(first, signal.SIGKILL)
        self.assertNotEqual(world.simulator(unlike=first), first)
        self.assertIsNone(world.launch.poll())

    def test_server_required_ends_the_launch_with_the_simulator(self):
        world = self.world("server_required:=true")
        os.kill(world.simulator(), signal.SIGKILL)
        world.launch.wait(BOUND)


if __name__ == "__main__":
    rostest.rosrun("cartpole", "launch_arguments", LaunchArgumentsTest)
