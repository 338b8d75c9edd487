#!/usr/bin/env python3
"""Scripts under lockstep.py that start their own simulator, or meet an unsuitable one."""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from functools import partial
from pathlib import Path

import rospkg
import rostest
from support.ros.programs import piped

from ros_calls import master
from ros_calls.waiting import wait_until
from ros_utils import ros_gazebo
from ros_utils.simulation import Simulation, reserved_port

ROOT = Path(rospkg.RosPack().get_path("cartpole"))
SCRIPTS = ROOT / "test" / "data" / "scripts"
EXISTING = Path(__file__).resolve().parents[4] / "shared" / "pg_script" / "launch_robot_test.py"
SCOUT = SCRIPTS / "scout.launch"
EPISODES = 10
KILLING = """
import os, signal, time, rospy
from std_srvs.srv import Empty
rospy.init_node('script')
rospy.ServiceProxy('/gazebo/unpause_physics', Empty)()
time.sleep(0.1)
from ros_calls import master
os.kill(master.call_node(master.call('lookupNode', '/gazebo'), 'getPid'), signal.SIGKILL)
"""  # of its simulator
BOUND = 300  # [s]


def environment():
    uri = f"http://127.0.0.1:{reserved_port()}"
    return os.environ | {"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "PYTHONUNBUFFERED": "1"}


start = partial(piped, "rosrun", "cartpole", "lockstep.py")


@contextlib.contextmanager
def scouting(**variables):
    """A scout in its arena, on a master of its own; yields the environment of scripts."""
    here = environment()
    port = here["ROS_MASTER_URI"].rpartition(":")[2]
    launch = subprocess.Popen(
        ["roslaunch", "-p", port, SCOUT],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**here, **variables},
    )  # fmt: skip
    try:
        with master.using(here["ROS_MASTER_URI"]):
            wait_until(master.is_up, BOUND, "the master")
            names = partial(ros_gazebo.gazebo_get_model_names, timeout=BOUND)
            wait_until(lambda: "scout" in names(), BOUND, "the scout")
        yield here
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(BOUND)


class LaunchingTest(unittest.TestCase):
    def ends(self, process, code=0):
        """Waits for its end with that exit code; returns its output and errors."""
        out, err = process.communicate(timeout=BOUND)
        self.assertEqual(process.returncode, code, err)
        return out, err

    def test_a_script_that_launches_everything_is_repeatable_also_on_a_busy_machine(self):
        """Two at once: each has a simulator, and takes the processor from the other."""
        script = SCRIPTS / "publish_read.py"
        both = [start("--seed", 3, script, env=environment()) for _ in range(2)]
        seen = []
        for process in both:
            out, _ = self.ends(process)
            seen.append([line for line in out.splitlines() if re.match(r"\d \d+ ", line)])
            self.assertGreater(len(seen[-1]), 190, out)
        self.assertEqual(*seen)

    def test_a_script_may_wait_for_a_message_before_its_simulator_is_up(self):
        out, _ = self.ends(start(SCRIPTS / "launch_and_wait.py", env=environment()))
        self.assertIn("ground_plane", out)

    @unittest.skipUnless(EXISTING.is_file(), "the existing script isn't here")
    def test_the_existing_script_is_repeatable_also_on_a_busy_machine(self):
        folders = [tempfile.mkdtemp(prefix="lockstep_test_") for _ in range(2)]
        for folder in folders:
            self.addCleanup(shutil.rmtree, folder)
        both = [start("--seed", 0, EXISTING, env=environment(), cwd=each) for each in folders]
        self.assertEqual(*map(self.episodes, both, folders))

    def episodes(self, process, folder):
        """What the script prints in its first episodes, and its weights after the first one."""
        lines = []
        try:
            for line in process.stdout:
                if line.startswith(f"Episode {EPISODES},"):
                    break
                if line.startswith("Episode"):
                    lines.append(line)
        finally:
            os.killpg(process.pid, signal.SIGINT)
            _, err = process.communicate(timeout=BOUND)
        self.assertGreater(len(lines), EPISODES, err)
        self.assertEqual(process.returncode, 0, err)  # as it ends without us
        return lines, Path(folder, "models", "policy_network_episode_0.pth").read_bytes()

    def told(self, process):
        """The lines that a script prints after each episode, and at its end."""
        out, _ = self.ends(process)
        lines = [line for line in out.splitlines() if re.match(r"\d+ |learned ", line)]
        self.assertIn("learned", lines[-1], out)
        return lines

    def test_scripts_of_robots_on_wheels_repeat_to_the_bit(self):
        """Its model of a goal comes and goes; its callback keeps the newest cloud. Two worlds at once."""
        with contextlib.ExitStack() as stack:
            worlds = [stack.enter_context(scouting(GZSERVER_ARGS="--lockstep")) for _ in range(2)]
            for name, lengths in {"goal_model.py": (2, 10), "newest_cloud.py": (2, 5)}.items():
                arguments = "--seed", 3, SCRIPTS / name, *lengths
                seen = [self.told(each) for each in [start(*arguments, env=e) for e in worlds]]
                self.assertEqual(len(seen[0]), lengths[0] + 1)
                self.assertEqual(*seen)

    def test_a_script_that_starts_roscore_and_places_its_robot_by_a_topic_repeats_to_the_bit(self):
        arguments = "--seed", 3, SCRIPTS / "state_topic.py"
        both = [start(*arguments, reserved_port(), 2, 10, env=environment()) for _ in range(2)]
        self.assertEqual(*map(self.told, both))

    def test_scripts_run_in_real_time_where_lockstep_refuses_them(self):
        own = piped(sys.executable, SCRIPTS / "state_topic.py", reserved_port(), 1, 3)
        with scouting() as here:
            for name in "goal_model.py", "newest_cloud.py":
                process = piped(sys.executable, SCRIPTS / name, 1, 3, env=here)
                self.assertEqual(len(self.told(process)), 2)
            _, err = self.ends(start(SCRIPTS / "rate_loop.py", env=here), 2)
            self.assertIn("runs in real time", err)
            self.assertIn('GZSERVER_ARGS="--lockstep --seed 0"', err)
        self.assertEqual(len(self.told(own)), 2)

    def run_script(self, text, code=0):
        """Runs a script at a simulator of its own; returns its output and errors."""
        with tempfile.TemporaryDirectory() as folder, Simulation(lockstep=True) as simulation:
            path = Path(folder, "script.py")
            path.write_text(text)
            return self.ends(start(path, env=simulation.environment()), code)

    def test_a_simulator_that_dies_is_told_of_and_ends_a_script_that_catches_all_and_waits_in_threads(self):
        text = (
            "import threading\ndef loop():\n while True: rospy.sleep(0.1)\n"
            "threading.Thread(target=loop).start()\n"
            "while True:\n try:\n  time.sleep(0.1)\n  print('went on')\n except: pass\n"
        )
        out, err = self.run_script(KILLING + text, 1)
        self.assertEqual(err.count("lockstep: "), 1, err)
        self.assertIn("the simulator has died", err)
        self.assertNotIn("Traceback", err)
        self.assertNotIn("went on", out)

    def test_the_end_of_a_script_is_told_once_for_all_nodes_that_follow_it(self):
        node = "import rospy, sys; rospy.init_node(sys.argv[1])\nwhile True: rospy.sleep(0.1)\n"
        text = (
            f"import subprocess, sys, rospy\nfor name in 'abc':\n"
            f" subprocess.Popen([sys.executable, '-c', {node!r}, name])\n"
            "rospy.init_node('script')\nrospy.sleep(1.0)\n"
        )
        _, err = self.run_script(text)
        said = [line for line in err.splitlines() if line.startswith("lockstep: ")]
        self.assertEqual(len(said), 1, err)
        self.assertIn("the nodes that follow its clock: /a, /b, /c", said[0])


if __name__ == "__main__":
    sys.exit(rostest.rosrun("cartpole", "scripts_launching", LaunchingTest))
