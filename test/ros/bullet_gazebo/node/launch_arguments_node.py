#!/usr/bin/env python3
"""Arguments of empty_world.launch that matter when the simulator is killed, fails or meets another one."""

import os
import signal
import subprocess
import tempfile
import threading
import unittest
import xmlrpc.client

import rosgraph
import rostest

from ros_utils.simulation import reserved_port

BOUND = 60.0  # [s]
SERVER = ("rosrun", "gazebo_ros", "gzserver")
SPAWN = ("rosrun", "gazebo_ros", "spawn_model", "-urdf", "-param", "/box", "-model", "box")
BOX = """<robot name="box"><link name="body"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<gazebo><plugin name="breaks" filename="libbreaks.so"/></gazebo></robot>"""


class World:
    """A world launched with arguments of the user's, on a master of its own."""

    def __init__(self, *args):
        self.log = tempfile.TemporaryFile()  # noqa: SIM115 - close() does
        port = reserved_port()
        self.uri = f"http://localhost:{port}"
        self._master = rosgraph.Master("/launch_arguments", self.uri)
        command = [
            "roslaunch",
            "-p",
            str(port),
            "gazebo_ros",
            "empty_world.launch",
            "gui:=false",
            *args,
        ]
        self.env = {**os.environ, "ROS_MASTER_URI": self.uri, "PYTHONUNBUFFERED": "1"}
        self.launch = subprocess.Popen(command, env=self.env, stdout=self.log, stderr=self.log)

    def start(self, *command):
        """Starts another program under its master."""
        return subprocess.Popen(
            command, env=self.env, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )

    def said(self):
        """What the launch has printed."""
        self.log.seek(0)
        return self.log.read().decode()

    def set_param(self, name, value):
        self._master.setParam(name, value)

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

    def test_a_world_that_fails_says_so_and_ends_the_launch(self):
        world = self.world("server_required:=true")
        world.simulator()
        world.set_param("/gazebo/plugins", {"libbreaks.so": "my_plugins:BreaksTheWorld"})
        world.set_param("/box", BOX)
        spawn = world.start(*SPAWN)
        world.launch.wait(BOUND)
        spawn.communicate(timeout=BOUND)
        self.assertIn("The simulation failed, so the node ends", world.said())
        self.assertIn("SystemExit: out of a tick", world.said())
        self.assertIn("exit code 1", world.said())

    def test_a_second_simulator_is_refused_while_the_first_lives_unless_it_shall_replace_it(self):
        world = self.world()
        first = world.simulator()
        second = world.start(*SERVER)
        said, _ = second.communicate(timeout=BOUND)
        self.assertEqual(second.returncode, 1)
        self.assertEqual(len(said.splitlines()), 1, said)
        self.assertIn(f"/gazebo runs at {world.uri} already", said)
        self.assertIn("ROS_MASTER_URI=http://localhost:", said)
        self.assertEqual(world.simulator(), first)
        third = world.start(*SERVER, "--replace")
        self.assertNotEqual(world.simulator(unlike=first), first)
        os.kill(third.pid, signal.SIGTERM)
        self.assertEqual(third.wait(BOUND), 0)
        world.launch.send_signal(signal.SIGINT)
        world.launch.wait(BOUND)
        self.assertIn("another node has taken the name /gazebo", world.said())
        self.assertNotIn("Traceback", world.said() + third.stdout.read())
        third.stdout.close()


if __name__ == "__main__":
    rostest.rosrun("cartpole", "launch_arguments", LaunchArgumentsTest)
