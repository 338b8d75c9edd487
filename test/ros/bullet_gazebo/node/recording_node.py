#!/usr/bin/env python3
"""`record:=FILE` leaves a complete video after Ctrl-C; what can't be recorded is one line of error."""

import re
import subprocess
import unittest

import imageio_ffmpeg
import rostest
from support.ros.programs import BOUND, Place

WORLD = ("gazebo_ros", "empty_world.launch", "gui:=false", "server_required:=true")


class Recording(unittest.TestCase):
    def setUp(self):
        self.place = Place()
        self.addCleanup(self.place.close)

    def test_a_video_is_whole_after_ctrl_c(self):
        video = self.place.folder / "it's a video.mp4"
        launch = self.place.start("roslaunch", "cartpole", "simulation.launch", "lockstep:=false",
                                  "paused:=false", f"record:={video}")  # fmt: skip
        launch.wait_for("starting joint_state_controller")
        launch.interrupt()
        self.assertEqual(self.place.left_after(), {}, launch.output)
        launch.end()
        told = re.search(r"recording: .*video\.mp4: (\d+) frames, [0-9.]+ s", launch.output)
        self.assertTrue(told and int(told[1]) > 0, launch.output)
        read = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(video), "-f", "null", "-"]
        self.assertEqual(subprocess.run(read, check=False, timeout=BOUND).returncode, 0)

    def test_what_cannot_be_recorded_is_one_line(self):
        launch = self.place.start("roslaunch", *WORLD, f"record:={self.place.folder}/a.avi")
        launch.end()
        self.assertIn("a recording's name ends in .mp4", launch.output)
        self.assertNotIn("Traceback", launch.output)


if __name__ == "__main__":
    rostest.rosrun("cartpole", "recording", Recording)
