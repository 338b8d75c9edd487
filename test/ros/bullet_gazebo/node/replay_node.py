#!/usr/bin/env python3
"""Runs in lock-step, recorded by rosbag or lockstep.py, and repeated by replay.py."""

import contextlib
import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rosbag
import rospkg
import rostest
from support.ros.calls import process_of
from support.ros.programs import piped

from bullet_gazebo.clients.gz import RemoteWorld
from ros_calls import master
from ros_calls.waiting import wait_until
from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf
from ros_utils.simulation import Simulation, reserved_port
from ros_utils.step_client import PreparedSteps, StepClient, StepNames

ROOT = Path(rospkg.RosPack().get_path("cartpole"))
DATA = ROOT / "test" / "data"
CART = "stand_cart_position_controller"
STATES = "joint_state_controller"
PUBLISHER = """
import sys
import rospy
from std_msgs.msg import Float64
rospy.init_node("another", disable_signals=True)
publisher = rospy.Publisher(sys.argv[1], Float64, queue_size=1, tcp_nodelay=True)
count = 0
while not publisher.get_num_connections():
    rospy.rostime.wallsleep(0.01)
print("connected", flush=True)
while not rospy.is_shutdown():
    publisher.publish(0.001 * (count % 100))
    count += 1
    rospy.rostime.wallsleep(0.003)
"""
BOUND = 300  # [s]


def replay(*arguments, **options):
    """Returns exit code, standard output and error of a replay."""
    process = piped("rosrun", "cartpole", "replay.py", *arguments, **options)
    out, err = process.communicate(timeout=BOUND)
    return process.returncode, out, err


def entries_of(bag):
    messages = rosbag.Bag(str(bag)).read_messages("/gazebo/journal")
    return [each for _, message, _ in messages for each in message.entries]


def add_cartpole(name="cartpole", pos_y=0.0):
    assert ros_urdf.urdf_load_from_pkg(
        "cartpole_gazebo", "cartpole_v1.urdf", "robot_description", folder="/robots", ns=f"/{name}"
    )
    assert ros_params.ros_load_yaml_from_pkg(
        "cartpole_controller", "joint_position_control.yaml", ns=f"/{name}"
    )
    spawned, text = ros_gazebo.gazebo_spawn_urdf_param(
        "robot_description", model_name=name, robot_namespace=f"/{name}", pos_y=pos_y
    )
    assert spawned, text


class ReplayTest(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="replay_test_"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.bag = self.folder / "run.bag"

    @contextlib.contextmanager
    def simulation(self, arguments=""):
        with Simulation(lockstep=True, extra_gazebo_args=arguments) as simulation, simulation.active():
            yield simulation

    @contextlib.contextmanager
    def recorded(self, arguments, *topics):
        """A simulator that is recorded from its beginning to its end, at which it sends the rest."""
        with self.simulation(arguments) as simulation:
            recorder = self.record(simulation, *topics)
            yield simulation
        recorder.communicate(timeout=BOUND)

    def record(self, simulation, *topics):
        """Starts `rosbag record`, and returns once it is connected."""
        recorder = piped(
            "rosbag", "record", "-O", self.bag, "__name:=recorder", "/gazebo/journal", *topics,
            env=simulation.environment(),
        )  # fmt: skip
        self.addCleanup(self.end, recorder)

        def is_connected():
            lines = master.call_node(master.call("lookupNode", "/gazebo"), "getBusInfo")
            return any(line[1:5:3] == ["/recorder", "/gazebo/journal"] for line in lines)

        self.assertTrue(wait_until(is_connected, BOUND, "the recorder"))
        return recorder

    def end(self, recorder):
        if recorder.poll() is None:
            os.killpg(recorder.pid, signal.SIGINT)
        recorder.communicate(timeout=BOUND)

    def check_equal(self, *arguments, at_least):
        code, out, err = replay(self.bag, *arguments)
        self.assertEqual(code, 0, out + err)
        found = re.search(r"equal to the bit: (\d+) entries, ([\d.]+) s", out)
        self.assertGreaterEqual(int(found[1]), at_least)
        return out

    def check_difference(self, pattern, *arguments):
        code, out, err = replay(self.bag, *arguments)
        self.assertEqual(code, 1, out + err)
        # Behind what the simulator complains of
        self.assertRegex(err.strip().splitlines()[-1], pattern)

    def test_a_stepped_world_with_all_that_comes_and_goes(self):
        """Robots come by services and a spawner and go again, another node commands, time is set back."""
        with self.recorded("--seed 3", "/clock", "/cartpole/joint_states") as simulation:
            add_cartpole()
            environment = simulation.environment()
            spawner = piped(
                "rosrun", "controller_manager", "spawner", "--namespace=/cartpole", STATES, CART,
                env=environment,
            )  # fmt: skip
            self.addCleanup(self.end, spawner)
            client = StepClient()

            def runs():
                client.step(1)
                listed = ros_controllers.list_controllers_srv("/cartpole") or {}
                return listed.get(CART) == "running"

            wait_until(runs, BOUND, "the spawner")
            another = piped(
                sys.executable, "-P", "-c", PUBLISHER, f"/cartpole/{CART}/command", env=environment
            )
            self.addCleanup(self.end, another)
            self.assertEqual(another.stdout.readline(), "connected\n")
            for index in range(160):
                client.step(8 if index % 20 else 3000)  # a long one lets others in between
            add_cartpole("second", pos_y=2.0)
            ros_controllers.spawn_controllers_srv([STATES, CART], ns="/second")
            for index in range(50):
                client.step(8, {f"/second/{CART}": 0.001 * index}, links=["second::pole"])
            ros_gazebo.gazebo_delete_model("second")
            client.step(50)
            client.reset({"cart_pole": 0.1}, everything=True, seed=5)
            client.step(100)
            self.end(another)
        topics = rosbag.Bag(str(self.bag)).get_type_and_topic_info().topics
        self.assertIn("/cartpole/joint_states", topics)
        entries = entries_of(self.bag)
        sent = [each.elapsed for each in entries if each.name == f"/cartpole/{CART}/command"]
        self.assertGreater(len(sent), 10)
        amid = [each for each in entries if any(each.elapsed < at < each.ended for at in sent)]
        self.assertTrue(amid, "no command came in the middle of a step")
        self.check_equal(at_least=300)
        gains = self.folder / "gains.yaml"
        gains.write_text("pid: {p: 15.0, i: 0.0, d: 3.0}\n")
        self.check_difference(
            r"first difference: at [\d.]+ s joint \w+ of cartpole: -?[\d.e-]+ recorded, -?[\d.e-]+ now",
            f"--params=/cartpole/{CART}={gains}",
        )
        robot = self.folder / "robot.urdf"
        robot.write_text('<robot name="empty"/>')
        self.check_difference(
            "spawn_urdf_model answered otherwise than now: .*no <link>", f"--model=cartpole={robot}"
        )

    def test_a_recorder_that_comes_late_gets_the_beginning(self):
        """With MuJoCo where it is installed."""
        engine = "ode" if importlib.util.find_spec("mujoco") is None else "mujoco"
        with self.simulation(f"-e {engine}") as simulation:
            add_cartpole()
            client = StepClient()
            client.reset({"cart_pole": 0.3})
            for _ in range(50):
                client.step(8)
            recorder = self.record(simulation)
            for _ in range(50):
                client.step(8)
        recorder.communicate(timeout=BOUND)
        self.assertIn("no states were recorded with the first", self.check_equal(at_least=104))

    def test_snapshots_gains_and_a_noisy_sensor(self):
        with self.recorded("--seed 7") as simulation:
            add_cartpole()
            self.go_back(simulation)
            self.change_gains(simulation)
            self.measure()
        # Time goes back by 1.2 s twice, and so is recorded three times.
        self.assertIn(" 5.224 s", self.check_equal(at_least=48))

    def call_service(self, simulation, *command):
        subprocess.run(["rosservice", "call", *command], env=simulation.environment(), check=True,
                       capture_output=True, timeout=BOUND)  # fmt: skip

    def go_back(self, simulation):
        client = StepClient()
        client.step(8)
        for request in ("save", "restore", "restore"):
            self.call_service(simulation, f"/gazebo/{request}_state", "name: here")
            client.step(1200)

    def change_gains(self, simulation):
        """By dynamic_reconfigure; a script loads the parameters again afterwards."""
        client = StepClient()
        for gain in (3.0, 5.0):
            ros_controllers.load_controller_srv(CART, ns="/cartpole")
            doubles = f"config: {{doubles: [{{name: p, value: {gain}}}]}}"
            self.call_service(simulation, f"/cartpole/{CART}/pid/set_parameters", doubles)
            client.step(8)
            ros_controllers.unload_controller_srv(CART, ns="/cartpole")
            assert ros_params.ros_load_yaml_from_pkg(
                "cartpole_controller", "joint_position_control.yaml", ns="/cartpole"
            )
        ros_controllers.spawn_controllers_srv([STATES, CART], ns="/cartpole")
        client.step(100, {f"/cartpole/{CART}": 0.3})

    def measure(self):
        text = (DATA / "sensors" / "bot.sdf").read_text()
        self.assertTrue(ros_gazebo.gazebo_spawn_sdf_string(text, "bot", pos_y=3.0))
        steps, names = PreparedSteps(), StepNames(sensors=("scanner",))
        seen = []
        for _ in range(30):
            steps.begin(names, 50, [])
            seen.append(steps.end().sensors)
        self.assertGreater(len({str(each) for each in seen}), 2)

    def test_a_simulator_that_goes_on_behind_the_end_of_its_bag(self):
        """As behind `lockstep.py --record`, if the script leaves its simulator running."""
        first = self.folder / "first.bag"
        with self.simulation(f"--journal {first}") as simulation:
            StepClient().step(8)
            RemoteWorld("/gazebo", simulation.master_uri).command("end_journal")
            recorder = self.record(simulation)
            StepClient().step(8)
        recorder.communicate(timeout=BOUND)
        self.assertIn(" 0.016 s", self.check_equal(at_least=3))
        self.bag = first
        self.assertIn(" 0.008 s", self.check_equal(at_least=2))

    def test_a_script_that_drives_a_vehicle_until_a_time(self):
        """state_topic.py draws poses, publishes them and commands, and waits for scans."""
        code, _, err = self.run_script(DATA / "scripts" / "state_topic.py", reserved_port(), 2, 10)
        self.assertEqual(code, 0, err)
        self.check_equal(at_least=30)
        out = self.check_equal("--until", "0.5", at_least=5)
        self.assertLess(float(re.search(r"([\d.]+) s$", out.strip())[1]), 1.0)
        topics = rosbag.Bag(str(self.bag)).get_type_and_topic_info().topics
        self.assertEqual(topics["/joint_states"].msg_type, "sensor_msgs/JointState")

    def run_script(self, script, *arguments):
        uri = f"http://127.0.0.1:{reserved_port()}"
        process = piped(
            "rosrun", "cartpole", "lockstep.py", "--seed=4", "--record", self.bag, script, *arguments,
            env={**os.environ, "ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1"},
        )  # fmt: skip
        self.addCleanup(self.end, process)
        out, err = process.communicate(timeout=BOUND)
        return process.returncode, out, err

    def test_a_script_that_fails_leaves_a_complete_bag_and_its_page_opens_where_a_user_looks(self):
        script = self.folder / "fails.py"
        script.write_text(
            "import rospy\n"
            "from ros_utils import ros_gazebo\n"
            "ros_gazebo.launch_Gazebo(gui=False, output='log', launch_new_term=False)\n"
            "rospy.init_node('fails')\n"
            "for _ in range(20):\n"
            "    rospy.sleep(0.1)\n"
            "raise SystemExit(7)\n"
        )
        code, _, err = self.run_script(script)
        self.assertEqual(code, 7, err)
        self.assertIn(f"recorded {self.bag}", err)
        process = piped("rosrun", "cartpole", "replay.py", self.bag, "--from", "1.5", "--gui")
        self.addCleanup(self.end, process)
        lines = [next(process.stdout) for _ in range(3)]
        self.assertIn("the window is the page http", lines[0])  # before the replay's end
        self.assertIn("equal to the bit", lines[2])
        self.assertIsNone(process.poll())  # the page stays

    def test_a_killed_simulators_bag_can_be_replayed(self):
        """All but the last second is in the file; rosbag finds it."""
        active = self.bag.with_name(f"{self.bag.name}.active")

        def reindexed():
            shutil.copy(active, self.bag)
            command = ["rosbag", "reindex", "--force", self.bag]
            subprocess.run(command, check=True, capture_output=True, timeout=BOUND)
            try:
                names = [each.name for each in entries_of(self.bag)]
            except rosbag.ROSBagUnindexedException:  # nothing is in it yet
                return False
            return names.count("/gazebo/prepared_step") == 10

        with self.simulation(f"--journal {self.bag}") as simulation:
            add_cartpole()
            client = StepClient()
            for _ in range(10):
                client.step(8)
            self.assertTrue(wait_until(reindexed, BOUND, "the bag"))
            os.kill(process_of(master_uri=simulation.master_uri), signal.SIGKILL)
        code, _, err = replay(active)
        self.assertEqual(code, 2)
        self.assertIn(f"rosbag reindex {active}", err)
        self.assertTrue(reindexed())
        self.check_equal(at_least=11)


if __name__ == "__main__":
    rostest.rosrun("cartpole", "replay", ReplayTest, sys.argv)
