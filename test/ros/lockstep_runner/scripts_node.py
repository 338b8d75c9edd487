#!/usr/bin/env python3
"""Scripts under lockstep.py in a running lock-step world (docs/lockstep.md)."""

import atexit
import importlib.util
import itertools
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rospkg
import rospy
import rostest
from controller_manager_msgs.srv import ListControllers
from support.ros.programs import piped

ROOT = Path(rospkg.RosPack().get_path("cartpole"))
SCRIPTS = ROOT / "test" / "data" / "scripts"
BOUND = 120  # [s]
HAS_SB3 = importlib.util.find_spec("stable_baselines3") is not None


def lockstep(*arguments, **options):
    command = [sys.executable, str(ROOT / "scripts" / "lockstep.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=BOUND, check=False, **options)


def written(text):
    """A script of a few lines, in a folder of its own."""
    path = Path(tempfile.mkdtemp(prefix="lockstep_test_")) / "script.py"
    # rostest runs no module cleanups
    atexit.register(shutil.rmtree, path.parent, ignore_errors=True)
    path.write_text(text)
    return path


HEAD = """
import sys, time, threading, rospy
from std_msgs.msg import Float64
from std_srvs.srv import Empty
rospy.init_node("script")
rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
pause = rospy.ServiceProxy("/gazebo/pause_physics", Empty)
rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
"""
COMMANDS = """
command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)
for step in range(5):
    command.publish(0.01)
    print(rospy.get_time())
"""


class LockstepTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.wait_for_service("/slides/controller_manager/list_controllers", 60)
        ask = rospy.ServiceProxy("/slides/controller_manager/list_controllers", ListControllers)
        while not any(each.state == "running" for each in ask().controller):
            rospy.rostime.wallsleep(0.05)

    def check(self, run, code=0):
        self.assertEqual(run.returncode, code, run.stderr)
        self.assertNotIn("Traceback", run.stderr)
        return run.stdout

    def output(self, text, *flags):
        """What a script prints that begins with HEAD."""
        return self.check(lockstep(*flags, written(HEAD + text)))

    def twice(self, name):
        one, two = (lockstep("--seed", 3, SCRIPTS / name) for _ in range(2))
        self.assertEqual(self.check(one), self.check(two))
        return one

    def check_50_hz(self, lines):
        times = [float(line.split()[0]) for line in lines]
        gaps = [round(later - earlier, 9) for earlier, later in itertools.pairwise(times)]
        self.assertEqual(set(gaps), {0.02})

    def test_unpause_publish_wait_pause(self):
        run = self.twice("pause_environment.py")
        self.assertNotIn("no joint states", run.stdout)
        other = lockstep("--seed", 4, SCRIPTS / "pause_environment.py")
        self.assertNotEqual(self.check(other), run.stdout)

    def test_polling_a_link(self):
        self.assertGreater(len(self.twice("poll_link_state.py").stdout.splitlines()), 20)

    def test_a_timer_a_callback_and_a_lock(self):
        lines = self.twice("timer_class.py").stdout.splitlines()
        self.assertEqual(len(lines), 200)
        self.check_50_hz(lines)

    def test_a_trajectory_client(self):
        out = self.twice("trajectory_client.py").stdout
        self.assertEqual(out.count("True 3 "), 3, out)

    def test_futures_a_queue_and_a_timer_of_python_s(self):
        self.assertEqual(len(self.twice("futures_queue.py").stdout.splitlines()), 6)

    def test_callbacks_that_command_and_a_shutdown_from_a_thread(self):
        out = self.twice("callbacks_rate.py").stdout
        self.assertEqual(out.count("beat"), 76, out)
        self.assertGreater(len(out.splitlines()), 200)

    def test_a_node_that_follows_ends_at_ctrl_c_while_the_script_computes(self):
        node = (
            "import rospy, time; rospy.init_node('follower'); rospy.set_param('/follower_is_up', 1)\n"
            "while not rospy.is_shutdown(): time.sleep(0.01)\n"
        )
        script = (
            "import signal, subprocess\n"
            f"node = subprocess.Popen([sys.executable, '-c', {node!r}])\n"
            "while not rospy.has_param('/follower_is_up'):\n    time.sleep(0.01)\n"
            "time.sleep(0.1)\nrospy.delete_param('/follower_is_up')\n"
            f"node.send_signal(signal.SIGINT)\nprint(node.wait({BOUND / 2}))\n"
        )
        self.assertEqual(self.output(script), "0\n")

    def test_a_thread_that_sleeps_is_told_of_once(self):
        run = self.twice("sleeping_thread.py")
        self.assertEqual(run.stderr.count("thread 'heart' sleeps by time.sleep"), 1, run.stderr)

    @unittest.skipUnless(HAS_SB3, "./ws extras isn't installed")
    def test_an_environment_that_sleeps_trains_with_stable_baselines3(self):
        self.assertIn(" 128 ", self.check(lockstep("--seed", 3, SCRIPTS / "gym_sleep.py", 128)))

    def test_a_service_call_under_a_lock_that_a_callback_wants(self):
        script = HEAD + (
            "from gazebo_msgs.srv import SetModelConfiguration\n"
            "from sensor_msgs.msg import JointState\n"
            "place = rospy.ServiceProxy('/gazebo/set_model_configuration', SetModelConfiguration)\n"
            "lock, seen = threading.RLock(), []\n"
            "def hear(message):\n    with lock:\n        seen.append(message.header.stamp.to_sec())\n"
            "def act(event):\n"
            "    with lock:\n"
            "        before = len(seen)\n"
            "        place('slide', '', ['slide_joint'], [0.01])\n"
            "        print(rospy.get_time(), len(seen) - before)\n"
            "rospy.Subscriber('/slides/joint_states', JointState, hear)\n"
            "timer = rospy.Timer(rospy.Duration(0.02), act)\n"
            "rospy.sleep(0.1)\ntimer.shutdown()\nprint(len(seen), seen == sorted(seen))\n"
        )
        runs = [lockstep(written(script)) for _ in range(2)]
        self.assertEqual([run.stderr for run in runs], ["", ""])
        self.assertEqual(*map(self.check, runs))

    def test_processes_that_are_forked_live_by_the_wall(self):
        script = (
            "import multiprocessing, os\n"
            "def square(x):\n    time.sleep(0.01)\n    return x * x\n"
            # Not terminated: rospy's handler of SIGTERM, which they inherit, doesn't end them.
            "pool = multiprocessing.Pool(2)\nprint(pool.map(square, range(4)))\n"
            "pool.close()\npool.join()\n"
            "child = os.fork()\n"
            "if not child:\n    time.sleep(0.01)\n    os._exit(3)\n"
            "before, wall = rospy.get_time(), time.monotonic()\ntime.sleep(0.5)\n"
            "print(round(rospy.get_time() - before, 6), time.monotonic() - wall == 0.5)\n"
            "print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))\n"
        )
        self.assertEqual(self.output(script), "[0, 1, 4, 9]\n0.5 False\n3\n")

    def test_the_wall_clock_may_be_simulated(self):
        script = (
            "from time import monotonic, perf_counter, sleep, time\n"
            "before = time(), monotonic(), perf_counter()\nsleep(25.0)\n"
            "after = time(), monotonic(), perf_counter()\n"
            "print(*(round(two - one, 6) for one, two in zip(before, after)))\n"
        )
        self.assertEqual(self.output(script, "--virtual-wall-clock"), "25.0 25.0 25.0\n")

    def test_scripts_that_were_cut_off_leave_the_world_to_the_next(self):
        text = "while not rospy.is_shutdown():\n    time.sleep(0.5)\n    print('on', flush=True)\n"
        endless = written(HEAD + text)
        for cut_off in ("closed", "killed"):
            process = piped("rosrun", "cartpole", "lockstep.py", endless, stderr=subprocess.DEVNULL)
            self.assertEqual(process.stdout.readline(), "on\n")
            if cut_off == "killed":
                process.kill()
            process.stdout.close()
            self.assertNotEqual(process.wait(BOUND), 0)
        self.check(lockstep(SCRIPTS / "rate_loop.py"))

    def test_two_scripts_at_once_share_the_time(self):
        text = HEAD.replace("reset_simulation", "unpause_physics") + (
            "for _ in range(50):\n    before = rospy.get_time()\n    time.sleep(0.02)\n"
            "    assert rospy.get_time() - before > 0.0199\nprint('done')\n"
        )
        scripts = [written(text.replace('"script"', f'"script_{n}"')) for n in range(2)]
        for process in [piped("rosrun", "cartpole", "lockstep.py", each) for each in scripts]:
            out, err = process.communicate(timeout=BOUND)
            self.assertEqual((process.returncode, out), (0, "done\n"), err)

    def test_a_command_is_a_control_period_where_nobody_waits(self):
        out = self.output(COMMANDS, "--dt", 0.002)
        self.assertEqual(out.split(), ["0.0", "0.004", "0.006", "0.008", "0.01"])

    def test_a_paused_world_stands_still_and_holds_nobody_up(self):
        script = "pause()\nfor _ in range(5):\n    time.sleep(100.0)\nprint(rospy.get_time())\n"
        self.assertEqual(self.output(script), "0.0\n")

    def test_what_is_left_at_the_end_of_a_script_ends(self):
        """An executor that nobody shut down, one that can't begin, a timer in a paused world."""
        script = (
            "import threading\n"
            "from concurrent.futures import BrokenExecutor, ThreadPoolExecutor\n"
            "left = ThreadPoolExecutor(2)\n"
            "print(left.submit(lambda: 5).result())\n"
            "late = left.submit(time.sleep, 0.5)\n"
            "late.add_done_callback(lambda _: print('slept', rospy.get_time()))\n"
            "def fails():\n    raise RuntimeError\n"
            "try:\n    ThreadPoolExecutor(1, initializer=fails).submit(int).result()\n"
            "except BrokenExecutor:\n    print('broken')\n"
        )
        self.assertEqual(self.output(script).split(), ["5", "broken", "slept", "0.5"])
        paused = (
            "import threading\npause()\n"
            "threading.Timer(0.1, lambda: print('off', rospy.get_time())).start()\n"
        )
        self.assertEqual(self.output(paused), "off 0.0\n")

    def test_ctrl_c_in_a_sleep(self):
        script = written(
            HEAD + "print('ready', flush=True)\n"
            "while not rospy.is_shutdown():\n    time.sleep(0.5)\nprint('done')\n"
        )
        process = piped("rosrun", "cartpole", "lockstep.py", script)
        self.assertEqual(process.stdout.readline(), "ready\n")
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        out, err = process.communicate(timeout=BOUND)
        self.assertEqual((process.returncode, out, err), (0, "done\n", ""))

    def test_what_is_raised_in_the_middle_of_a_step(self):
        interrupted = (
            "import signal\n"
            "def bell(*_):\n    raise raised\n"
            "signal.signal(signal.SIGALRM, bell)\n"
            "for raised in RuntimeError, TimeoutError, SystemExit(5):\n"  # the second as a connection
            "    signal.setitimer(signal.ITIMER_REAL, 0.2)\n"
            "    try:\n        while True:\n            time.sleep(0.5)\n"
            "    except (RuntimeError, TimeoutError):\n        pass\n"
            "    before = rospy.get_time()\n    time.sleep(1.0)\n"
            "    print(round(rospy.get_time() - before, 6))\n"
        )
        run = lockstep(written(HEAD + interrupted))
        self.assertEqual((run.returncode, run.stdout, run.stderr), (5, "1.0\n1.0\n", ""))
        self.check(lockstep(SCRIPTS / "rate_loop.py"))


if __name__ == "__main__":
    os.environ.setdefault("PYTHONUNBUFFERED", "1")
    sys.exit(rostest.rosrun("cartpole", "scripts", LockstepTest))
