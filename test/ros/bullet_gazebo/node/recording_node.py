#!/usr/bin/env python3
"""`record:=FILE` leaves a complete video after Ctrl-C; what can't be recorded is one line of error."""

import os
import re
import signal
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

import imageio_ffmpeg
import rostest

from ros_utils.simulation import reserved_port

BOUND = 100.0  # [s]
WORLD = ("gazebo_ros", "empty_world.launch", "gui:=false", "server_required:=true")


class Recording(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.log = self.folder / "log"

    def launch(self, *arguments):
        port = reserved_port()
        env = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{port}", "PYTHONUNBUFFERED": "1"}
        with self.log.open("w") as log:
            launch = subprocess.Popen(
                ["roslaunch", "-p", str(port), *arguments], env=env, stdout=log, stderr=log
            )
        self.addCleanup(launch.wait, BOUND)
        self.addCleanup(launch.send_signal, signal.SIGINT)
        return launch

    def await_line(self, pattern):
        """What the launch, or what it has left to finish the video, says."""
        pause = threading.Event()
        for _ in range(int(BOUND / 0.2)):
            found = re.search(pattern, self.log.read_text())
            if found:
                return found
            pause.wait(0.2)
        raise AssertionError(f"nothing said {pattern!r}:\n{self.log.read_text()}")

    def test_a_video_is_whole_after_ctrl_c(self):
        video = self.folder / "it's a video.mp4"
        launch = self.launch("cartpole", "simulation.launch", "lockstep:=false", "paused:=false",
                             f"record:={video}")  # fmt: skip
        self.await_line("starting joint_state_controller")
        launch.send_signal(signal.SIGINT)
        launch.wait(BOUND)
        told = self.await_line(r"recording: .*video\.mp4: (\d+) frames, [0-9.]+ s")
        self.assertGreater(int(told[1]), 0)
        read = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(video), "-f", "null", "-"]
        self.assertEqual(subprocess.run(read, check=False, timeout=BOUND).returncode, 0)

    def test_what_cannot_be_recorded_is_one_line(self):
        launch = self.launch(*WORLD, f"record:={self.folder}/a.avi")
        self.assertNotIn("Traceback", self.await_line(r"a recording's name ends in \.mp4")[0])
        launch.wait(BOUND)
        self.assertNotIn("Traceback", self.log.read_text())


if __name__ == "__main__":
    rostest.rosrun("cartpole", "recording", Recording)
