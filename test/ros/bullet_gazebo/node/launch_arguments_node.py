#!/usr/bin/env python3
"""Arguments of empty_world.launch that matter when the simulator is killed, fails or meets another one."""

import contextlib
import os
import signal
import unittest

import rosgraph
import rostest
from support.ros.calls import process_of, wait_until
from support.ros.programs import BOUND, Place

SERVER = ("rosrun", "gazebo_ros", "gzserver")
SPAWN = ("rosrun", "gazebo_ros", "spawn_model", "-urdf", "-param", "/box", "-model", "box")
BOX = """<robot name="box"><link name="body"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<gazebo><plugin name="breaks" filename="libbreaks.so"/></gazebo></robot>"""


class LaunchArgumentsTest(unittest.TestCase):
    def setUp(self):
        self.place = Place()
        self.addCleanup(self.place.close)
        self.uri = self.place.environment["ROS_MASTER_URI"]
        self.master = rosgraph.Master("/launch_arguments", self.uri)

    def world(self, *arguments):
        """A world launched with arguments of the user's."""
        launch = ("roslaunch", "gazebo_ros", "empty_world.launch", "gui:=false")
        return self.place.start(*launch, *arguments)

    def simulator(self, unlike=None):
        """Process id of the simulator once it is up, and another one than `unlike`."""

        def up():
            with contextlib.suppress(rosgraph.MasterException, OSError):
                pid = process_of(master_uri=self.uri)
                self.master.lookupService("/gazebo/pause_physics")
                return pid if pid != unlike else None

        found = wait_until(up, BOUND)
        self.assertTrue(found, "no simulator came up")
        return found

    def test_respawn_gazebo_starts_a_killed_simulator_again(self):
        self.world("respawn_gazebo:=true")
        first = self.simulator()
        os.kill(first, signal.SIGKILL)
        self.assertNotEqual(self.simulator(unlike=first), first)

    def test_a_world_that_fails_says_so_and_ends_the_launch_if_it_is_required(self):
        world = self.world("server_required:=true")
        self.simulator()
        self.master.setParam("/gazebo/plugins", {"libbreaks.so": "my_plugins:BreaksTheWorld"})
        self.master.setParam("/box", BOX)
        spawn = self.place.start(*SPAWN)
        world.end()
        spawn.end()
        self.assertIn("The simulation failed, so the node ends", world.output)
        self.assertIn("SystemExit: out of a tick", world.output)
        self.assertIn("exit code 1", world.output)

    def test_a_second_simulator_is_refused_while_the_first_lives_unless_it_shall_replace_it(self):
        world = self.world()
        first = self.simulator()
        second = self.place.start(*SERVER)
        self.assertEqual(second.end(), 1)
        self.assertEqual(len(second.output.splitlines()), 1, second.output)
        self.assertIn(f"/gazebo runs at {self.uri} already", second.output)
        self.assertIn("ROS_MASTER_URI=http://", second.output)
        self.assertEqual(self.simulator(), first)
        third = self.place.start(*SERVER, "--replace")
        self.assertNotEqual(self.simulator(unlike=first), first)
        third.send(signal.SIGTERM)
        self.assertEqual(third.end(), 0)
        world.interrupt()
        world.end()
        self.assertIn("another node has taken the name /gazebo", world.output)
        self.assertNotIn("Traceback", world.output + third.output)


if __name__ == "__main__":
    rostest.rosrun("cartpole", "launch_arguments", LaunchArgumentsTest)
