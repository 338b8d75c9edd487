"""spawner and unspawner: in launch files, on the command line, and every line they print."""

import itertools
import re
import signal
import subprocess
import tempfile
import threading
from pathlib import Path

import rospy
from controller_client import CartPoleCase
from std_msgs.msg import Bool
from support.ros.calls import BOUND, executable, gazebo, wait_until
from support.ros.manager import STRICT, Manager

LAUNCH = """
<launch>
  <group ns="{namespace}">
    <rosparam command="load" file="{file}"/>
    <node name="controllers" pkg="controller_manager" type="spawner" output="screen"
      args="states cart {options}"/>
  </group>
</launch>
"""
FIRST = """
states: {type: joint_state_controller/JointStateController, publish_rate: 100}
cart:
  type: effort_controllers/JointPositionController
  joint: stand_cart
  pid: {p: 1.0}
"""
SECOND = "pole: {type: effort_controllers/JointPositionController, joint: cart_pole, pid: {p: 1.0}}"
RUNNING = {"states": "running", "cart": "running"}
COLOUR, STAMP = re.compile(r"\x1b\[[0-9;]*m"), re.compile(r"^\[(\w+)\] \[[\d., ]+\]: ")


class SpawnerTest(CartPoleCase):
    def setUp(self):
        for name in ("states", "cart", "pole"):
            if rospy.has_param(f"/{name}"):
                rospy.delete_param(f"/{name}")
        self.spawn_cartpole()
        self.manager = Manager()
        self.programs = []
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.first, self.second = self.file("first.yaml", FIRST), self.file("second.yaml", SECOND)

    def tearDown(self):
        for program in self.programs:
            program.send_signal(signal.SIGINT)
            program.communicate(timeout=BOUND)

    def file(self, name, text):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    def start(self, *command):
        program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.programs.append(program)
        return program

    def spawner(self, *arguments):
        return self.start(executable("controller_manager", "spawner"), *arguments)

    def unspawner(self, *arguments):
        return self.start(executable("controller_manager", "unspawner"), *arguments)

    def end(self, program, number):
        program.send_signal(number)
        return self.ends(program)

    def ends(self, program, code=0):
        """Returns the lines that the program has printed, without colours and times."""
        self.programs.remove(program)
        output, _ = program.communicate(timeout=BOUND)
        self.assertEqual(program.returncode, code, output)
        return [STAMP.sub(r"\1: ", line) for line in COLOUR.sub("", output).splitlines()]

    def expect_states(self, expected, manager=None):
        manager = manager or self.manager
        found = wait_until(lambda: list(manager.states().items()) == list(expected.items()))
        self.assertTrue(found, f"{manager.states()} instead of {expected}")

    # in a launch file

    def launch(self, namespace="/", options=""):
        text = LAUNCH.format(namespace=namespace, file=self.first, options=options)
        return self.start("roslaunch", self.file("robot.launch", text))

    def test_a_launch_file_starts_controllers_and_takes_them_along_when_it_ends(self):
        launch = self.launch()
        self.expect_states(RUNNING)
        self.end(launch, signal.SIGINT)
        self.expect_states({})

    def test_in_the_namespace_of_the_launch_file(self):
        self.spawn_cartpole("second", robot_namespace="/my_robot")
        launch = self.launch("my_robot", "--stopped --shutdown-timeout 3")
        robot = Manager("/my_robot")
        self.expect_states({"states": "initialized", "cart": "initialized"}, robot)
        self.assertEqual(self.manager.states(), {})
        self.end(launch, signal.SIGTERM)
        self.expect_states({}, robot)

    # files, options and lines

    def test_files_and_names_in_any_order(self):
        spawner = self.spawner(self.second, "--timeout", "-1", self.first)
        self.expect_states({"pole": "running"} | RUNNING)
        self.assertEqual(rospy.get_param("/cart/pid/p"), 1.0)
        self.end(spawner, signal.SIGTERM)
        self.expect_states({})
        self.spawner("pole", self.first)
        self.expect_states({"pole": "running"} | RUNNING)

    def test_a_file_goes_into_the_namespace(self):
        self.spawn_cartpole("second", robot_namespace="/my_robot")
        self.spawner("--namespace", "/my_robot", self.second)
        self.expect_states({"pole": "running"}, Manager("/my_robot"))
        self.assertTrue(rospy.has_param("/my_robot/pole/type"))
        self.assertFalse(rospy.has_param("/pole/type"))

    def test_a_file_that_is_none(self):
        path = self.file("bad.yaml", "just text")
        lines = self.ends(self.spawner(path), 1)
        self.assertIn(path, lines[-1])
        self.assertNotIn("Traceback", "".join(lines))
        self.assertEqual(self.manager.states(), {})

    def test_printed_lines(self):
        rospy.set_param("/cart", {"type": "effort_controllers/JointPositionController",
                                  "joint": "stand_cart", "pid": {"p": 1.0}})  # fmt: skip
        spawner = self.spawner("cart", self.second)
        self.expect_states({"cart": "running", "pole": "running"})
        lines = self.end(spawner, signal.SIGINT)
        service = "INFO: Controller Spawner: Waiting for service controller_manager"
        self.assertEqual(
            lines,
            [
                f"{service}/load_controller",
                f"{service}/switch_controller",
                f"{service}/unload_controller",
                "INFO: Loading controller: cart",
                "INFO: Loading controller: pole",
                "INFO: Controller Spawner: Loaded controllers: cart, pole",
                "INFO: Started controllers: cart, pole",
                "INFO: Shutting down spawner. Stopping and unloading controllers...",
                "INFO: Stopping all controllers...",
                "INFO: Unloading all loaded controllers...",
                "INFO: Trying to unload pole",
                "INFO: Succeeded in unloading pole",
                "INFO: Trying to unload cart",
                "INFO: Succeeded in unloading cart",
            ],
        )

    def test_where_nothing_can_be_loaded_it_stays(self):
        spawner = self.spawner("nobody", "noone")
        for line in spawner.stdout:
            if "Started controllers" in line:
                break
        self.assertIn("Started controllers: \n", COLOUR.sub("", line))
        self.assertIsNone(spawner.poll())

    def test_one_that_somebody_else_stopped_keeps_no_other(self):
        spawner = self.spawner(self.second, self.first)
        self.expect_states({"pole": "running"} | RUNNING)
        self.assertTrue(self.manager.switch([], ["pole"], STRICT))
        self.end(spawner, signal.SIGINT)
        self.expect_states({})

    def test_wait_for_goes_on_after_the_timeout(self):
        gate = rospy.Publisher("/never", Bool, queue_size=1, latch=True)
        gate.publish(False)
        self.spawner("--wait-for", "/never", "--timeout", "1", self.second)
        self.expect_states({"pole": "running"})

    def test_wait_for_waits_for_true(self):
        gate = rospy.Publisher("/gate", Bool, queue_size=1, latch=True)
        gate.publish(False)
        self.spawner("--wait-for", "/gate", "--no-timeout", self.second)
        self.assertTrue(wait_until(gate.get_num_connections))
        self.assertEqual(self.manager.states(), {})
        gate.publish(True)
        self.expect_states({"pole": "running"})

    def test_an_unknown_controller_does_not_keep_the_others_from_starting(self):
        spawner = self.spawner("nobody", self.second)
        self.expect_states({"pole": "running"})
        self.assertIn("Failed to load nobody", "".join(self.end(spawner, signal.SIGINT)))

    def test_wait_for_is_interrupted_by_ctrl_c(self):
        spawner = self.spawner("--wait-for", "/never", "--timeout", "0", self.second)
        listeners = rospy.Publisher("/never", Bool, queue_size=1)
        self.assertTrue(wait_until(listeners.get_num_connections))
        self.end(spawner, signal.SIGINT)
        self.assertEqual(self.manager.states(), {})

    # ended by others, and unspawner

    def test_rosnode_kill_ends_both_well(self):
        spawner = self.spawner(self.first, "__name:=my_spawner")
        self.expect_states(RUNNING)
        unspawner = self.unspawner("cart", "__name:=my_unspawner")
        self.expect_states({"states": "running", "cart": "stopped"})
        for program, name, states in ((unspawner, "/my_unspawner", RUNNING), (spawner, "/my_spawner", {})):
            subprocess.run(["rosnode", "kill", name], check=True, stdout=subprocess.DEVNULL)
            self.ends(program)
            self.expect_states(states)

    def test_unspawner_starts_only_what_it_has_stopped(self):
        self.spawner(self.first)
        self.expect_states(RUNNING)
        self.spawner("--stopped", self.second)
        self.expect_states(RUNNING | {"pole": "initialized"})
        unspawner = self.unspawner("pole", "cart", "nobody")
        self.expect_states({"states": "running", "cart": "stopped", "pole": "initialized"})
        lines = self.end(unspawner, signal.SIGTERM)
        self.expect_states(RUNNING | {"pole": "initialized"})
        service = "INFO: Unspawner: Waiting for service controller_manager"
        self.assertEqual(
            lines,
            [
                f"{service}/switch_controller",
                f"{service}/list_controllers",
                "INFO: Stopped controllers: cart",
                "INFO: Started controllers: cart",
            ],
        )

    def test_unspawner_gives_back_what_somebody_else_has_started_meanwhile(self):
        self.spawner(self.first)
        self.expect_states(RUNNING)
        unspawner = self.unspawner("cart")
        self.expect_states({"states": "running", "cart": "stopped"})
        self.assertTrue(self.manager.switch(["cart"], [], STRICT))
        self.expect_states({"states": "running", "cart": "stopped"})
        self.end(unspawner, signal.SIGINT)
        self.expect_states(RUNNING)

    # without a manager

    def test_z_without_a_manager_it_says_so_and_ends(self):
        """The last one by its name: from now on simulated time isn't zero any more."""
        gazebo("unpause_physics")
        self.addCleanup(gazebo, "pause_physics")
        spawner = self.spawner("--namespace", "/nowhere", "--timeout", "1", self.second)
        lines = self.ends(spawner, 1)
        self.assertIn("couldn't find the expected controller_manager ROS interface", lines[-1])

    def test_while_simulated_time_stands_at_zero_the_timeout_begins_anew(self):
        spawner = self.spawner("--namespace", "/late", "--timeout", "0.2", self.second)
        # It says so, and the robot comes after several timeouts.
        retries = (line for line in spawner.stdout if "still waiting" in line)
        for line in itertools.islice(retries, 3):
            self.assertIn("/late/controller_manager/load_controller", line)
        self.spawn_cartpole("second", robot_namespace="/late")
        reader = threading.Thread(target=spawner.stdout.read, daemon=True)
        reader.start()
        self.expect_states({"pole": "running"}, Manager("/late"))
        spawner.send_signal(signal.SIGINT)
        reader.join(BOUND)
        self.expect_states({}, Manager("/late"))
