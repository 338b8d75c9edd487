#!/usr/bin/env python3
"""spawner and unspawner against the stand-in, through rosrun, with Ctrl-C at the end."""

import signal
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

import rospy
import rostest
from controller_manager_msgs.srv import ListControllers, SwitchController
from gazebo_msgs.srv import DeleteModel, SpawnModel, SpawnModelRequest
from std_msgs.msg import Bool
from std_srvs.srv import Empty

BOUND = 60.0  # [s of wall time]
STATES, CART = "joint_state_controller", "stand_cart_position_controller"
EXTRA = """
another_controller:
  type: effort_controllers/JointPositionController
  joint: cart_pole
  pid: {p: 1.0}
"""


def call(name, kind, *args):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind)(*args)


def states():
    listed = call("/controller_manager/list_controllers", ListControllers).controller
    return {each.name: each.state for each in listed}


class SpawnerTest(unittest.TestCase):
    def setUp(self):
        xml = rospy.get_param("/robot_description")
        request = SpawnModelRequest(model_name="cartpole", model_xml=xml, robot_namespace="/")
        self.assertTrue(call("/gazebo/spawn_urdf_model", SpawnModel, request).success)
        self.programs = []

    def tearDown(self):
        for program in self.programs:
            self.interrupt(program)
        call("/gazebo/delete_model", DeleteModel, "cartpole")

    def run_script(self, name, *args):
        command = ["rosrun", "controller_manager", name, *args]
        program = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self.programs.append(program)
        return program

    def interrupt(self, program):
        """Ctrl-C; returns what the program had printed."""
        if program.poll() is None:
            program.send_signal(signal.SIGINT)
        output, _ = program.communicate(timeout=BOUND)
        self.programs = [each for each in self.programs if each is not program]
        return output

    def wait_for(self, wanted):
        pause = threading.Event()
        for _ in range(int(BOUND / 0.05)):
            if states() == wanted:
                return
            pause.wait(0.05)
        self.fail(f"{states()} instead of {wanted}")

    def test_spawner_starts_while_paused_and_unloads_on_ctrl_c(self):
        spawner = self.run_script("spawner", STATES, CART, "__name:=my_spawner")
        self.wait_for({STATES: "running", CART: "running"})
        output = self.interrupt(spawner)
        self.assertIn(f"Started controllers: {STATES}, {CART}", output)
        self.wait_for({})
        self.assertEqual(spawner.returncode, 0)

    def test_stopped_loads_only(self):
        self.run_script("spawner", "--stopped", CART)
        self.wait_for({CART: "initialized"})

    def test_a_yaml_file_is_loaded_and_its_controllers_spawned(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "extra controllers.yaml")
            path.write_text(EXTRA, encoding="utf-8")
            self.run_script("spawner", str(path))
            self.wait_for({"another_controller": "running"})

    def test_wait_for_waits_for_true(self):
        gate = rospy.Publisher("/gate", Bool, queue_size=1, latch=True)
        gate.publish(False)
        self.run_script("spawner", "--wait-for", "/gate", "--no-timeout", CART)
        for _ in range(int(BOUND / 0.05)):
            if gate.get_num_connections():
                break
            threading.Event().wait(0.05)
        self.assertEqual(states(), {})
        gate.publish(True)
        self.wait_for({CART: "running"})

    def test_an_unknown_controller_does_not_keep_the_others_from_starting(self):
        spawner = self.run_script("spawner", "nobody", CART)
        self.wait_for({CART: "running"})
        self.assertIn("Failed to load nobody", self.interrupt(spawner))

    def test_without_a_manager_it_says_so_and_ends(self):
        # As long as simulated time stands at zero it would wait for the simulator to begin.
        call("/gazebo/unpause_physics", Empty)
        self.addCleanup(call, "/gazebo/pause_physics", Empty)
        spawner = self.run_script("spawner", "--namespace", "/nowhere", "--timeout", "1", CART)
        output, _ = spawner.communicate(timeout=BOUND)
        self.assertEqual(spawner.returncode, 1)
        self.assertIn("couldn't find the expected controller_manager ROS interface", output)

    def test_unspawner_keeps_controllers_stopped_and_gives_them_back(self):
        self.run_script("spawner", STATES, CART)
        self.wait_for({STATES: "running", CART: "running"})
        unspawner = self.run_script("unspawner", CART)
        self.wait_for({STATES: "running", CART: "stopped"})
        call("/controller_manager/switch_controller", SwitchController, [CART], [], 2, False, 0.0)
        self.wait_for({STATES: "running", CART: "stopped"})
        self.interrupt(unspawner)
        self.wait_for({STATES: "running", CART: "running"})


if __name__ == "__main__":
    rospy.init_node("spawner_test")
    rostest.rosrun("cartpole", "spawner", SpawnerTest)
