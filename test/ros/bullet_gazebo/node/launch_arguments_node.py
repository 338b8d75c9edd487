#!/usr/bin/env python3
"""Arguments of empty_world.launch that show when the simulator ends, and `record:=FILE`."""

import contextlib
import os
import re
import signal
import subprocess

import imageio_ffmpeg
import rosgraph
import rostest
from support.ros.calls import process_of, wait_until
from support.ros.programs import BOUND, PlaceCase

SERVER = ("rosrun", "gazebo_ros", "gzserver")
WORLD = ("roslaunch", "gazebo_ros", "empty_world.launch", "gui:=false")
SPAWN = ("rosrun", "gazebo_ros", "spawn_model", "-urdf", "-param", "/box", "-model", "box")
BOX = """<robot name="box"><link name="body"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<gazebo><plugin name="breaks" filename="libbreaks.so"/></gazebo></robot>"""


class LaunchArgumentsTest(PlaceCase):
    def setUp(self):
        super().setUp()
        self.uri = self.place.environment["ROS_MASTER_URI"]
        self.master = rosgraph.Master("/launch_arguments", self.uri)

    def world(self, *arguments):
        """A world launched with arguments of the user's."""
        return self.place.start(*WORLD, *arguments)

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
        refusal = self.run_here(*SERVER, code=1)
        self.assertEqual(len(refusal.splitlines()), 1, refusal)
        self.assertRegex(refusal, f"/gazebo runs at {self.uri} already.*ROS_MASTER_URI=http://")
        self.assertEqual(self.simulator(), first)
        third = self.place.start(*SERVER, "--replace")
        self.assertNotEqual(self.simulator(unlike=first), first)
        third.send(signal.SIGTERM)
        self.ends(third)
        world.interrupt()
        world.end()
        self.assertIn("another node has taken the name /gazebo", world.output)
        self.assertNotIn("Traceback", world.output)


class Recording(PlaceCase):
    def test_a_video_is_whole_after_ctrl_c(self):
        video = self.place.folder / "it's a video.mp4"
        launch = self.place.start("roslaunch", "cartpole", "simulation.launch", "lockstep:=false",
                                  "paused:=false", f"record:={video}")  # fmt: skip
        launch.wait_for("starting joint_state_controller")
        launch.interrupt()
        self.assert_nothing_left(launch.output)
        launch.end()
        told = re.search(r"recording: .*video\.mp4: (\d+) frames, [0-9.]+ s", launch.output)
        self.assertTrue(told and int(told[1]) > 0, launch.output)
        read = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(video), "-f", "null", "-"]
        self.assertEqual(subprocess.run(read, check=False, timeout=BOUND).returncode, 0)

    def test_what_cannot_be_recorded_is_one_line(self):
        video = f"record:={self.place.folder}/a.avi"
        launch = self.place.start(*WORLD, "server_required:=true", video)
        launch.end()
        self.assertIn("a recording's name ends in .mp4", launch.output)
        self.assertNotIn("Traceback", launch.output)


if __name__ == "__main__":
    rostest.rosrun("cartpole", "launch_arguments", "__main__")
