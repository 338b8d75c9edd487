#!/usr/bin/env python3
"""Ready: launch and wait for worlds; a line for each thing that is missing."""

import contextlib
import io
import os
import tempfile
import unittest
import unittest.mock
from functools import partial
from pathlib import Path

import gymnasium
import rostest

import cartpole  # noqa: F401  # registers the environments
from robot_envs.errors import SimulatorError
from ros_calls.waiting import wait_until
from ros_utils import ros_controllers, ros_gazebo, ros_launch, ros_node, ros_params, ros_spawn
from ros_utils.readiness import NotReady, Ready
from ros_utils.ros_urdf import urdf_load_from_pkg
from ros_utils.service_client import ServiceGone
from ros_utils.simulation import Simulation, reserved_port
from ros_utils.step_client import StepClient, StepRefused

PATIENCE = 180.0  # [s]
CART = "stand_cart_position_controller"
ALL = ["joint_state_controller", CART]
READY = Ready(["cartpole"], ALL, lockstep=True)
LATER = """<launch>
<include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="gui" value="false"/></include>
<rosparam command="load" file="$(find cartpole_controller)/config/joint_position_control.yaml" ns="arm"/>
<param name="arm/robot_description" command="xacro '$(find cartpole)/urdf/cartpole.urdf.xacro'"/>
<node name="spawn" pkg="gazebo_ros" type="spawn_model" ns="arm"
  args="-urdf -param robot_description -model arm -robot_namespace /arm"/>
<node name="spawner" pkg="controller_manager" type="spawner" ns="arm" args="{controllers}"/></launch>"""

DIES = """<launch><node name="bag" pkg="rosbag" type="play" args="nothing.bag" required="true"/></launch>"""


def said(function, *arguments, **options):
    """What a function returns, and what it prints as an error."""
    with contextlib.redirect_stderr(io.StringIO()) as text:
        answer = function(*arguments, **options)
    return answer, text.getvalue()


class Readiness(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.simulation = Simulation()
        cls.addClassCleanup(cls.simulation.close)

    def empty_world(self):
        """Calls go to the simulation from now on, which has no robot, and is left without one."""
        self.enterContext(self.simulation.active())
        for name in ("cartpole", "cartpole2", "second"):
            self.addCleanup(ros_gazebo.gazebo_delete_model, name)

    def launch_file(self, *controllers, text=LATER):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        path = Path(folder, "arm.launch")
        path.write_text(text.format(controllers=" ".join(controllers)))
        return str(path)

    def test_a_launch_is_ready_when_it_returns(self):
        ready = Ready("arm", [f"/arm/{name}" for name in ALL])
        port = reserved_port()
        started = ros_launch.ros_launch_from_path(
            self.launch_file(*ALL), launch_new_term=False, timeout=PATIENCE, ready=ready,
            master_uri=f"http://127.0.0.1:{port}", env={"ROS_IP": "127.0.0.1"},
        )  # fmt: skip
        self.assertTrue(started)
        self.addCleanup(started.close)
        with unittest.mock.patch.dict(os.environ, ROS_MASTER_URI=started.master_uri):
            self.assertEqual(ready.missing(), "")
            states = ros_controllers.list_controllers_srv("arm")
            self.assertEqual(states, dict.fromkeys(ALL, "running"))
            answer, text = said(
                ros_gazebo.launch_Gazebo, ready=Ready(["leg"]), timeout=0.2, launch_new_term=False
            )
            node = ros_node.ros_node_from_pkg("topic_tools", "relay", args="a b", launch_new_term=False,
                                              timeout=PATIENCE, ready=ready)  # fmt: skip
        self.assertTrue(node)
        self.assertFalse(answer)
        self.assertIn("there is no model 'leg' in the world (there are: ground_plane, arm)", text)
        self.assertTrue(started.running, "it ran before, so it isn't ended")

    def test_a_launch_that_ends_is_not_waited_for(self):
        answer, text = said(
            ros_launch.ros_launch_from_path, self.launch_file(text=DIES), launch_new_term=False,
            timeout=PATIENCE, ready=READY, master_uri=f"http://127.0.0.1:{reserved_port()}",
        )  # fmt: skip
        self.assertFalse(answer)
        self.assertIn("before it was ready", text)

    def test_each_thing_that_is_missing_has_its_words(self):
        uri = f"http://127.0.0.1:{reserved_port()}"
        with unittest.mock.patch.dict(os.environ, ROS_MASTER_URI=uri):
            self.assertIn(f"no ROS master at {uri}", READY.missing())
        with self.roscore(uri):
            self.assertIn(f"no simulator runs at {uri}; start one with: roslaunch", READY.missing())
            with self.assertRaisesRegex(ServiceGone, "no simulator runs at .* lockstep:=true"):
                StepClient().step(1)
        self.empty_world()
        self.assertIn("the simulator isn't in lock-step", READY.missing())
        with self.assertRaisesRegex(ServiceGone, "isn't in lock-step; .* lockstep:=true"):
            StepClient().step(1)
        ready = Ready(["cartpole"], ALL)
        self.assertIn("there is no model 'cartpole' in the world", ready.missing())
        self.spawn("cartpole2", "/second")
        self.assertIn("(did you mean 'cartpole2'?)", ready.missing())
        leg = Ready([], ALL, "leg").missing()
        self.assertIn("there is no controller manager in the namespace /leg", leg)
        urdf = ("cartpole", "cartpole.urdf.xacro", "robot_description")
        self.assertTrue(urdf_load_from_pkg(*urdf))
        gains = ("cartpole_controller", "joint_position_control.yaml")
        self.assertTrue(ros_params.ros_load_yaml_from_pkg(*gains))
        self.spawn("cartpole", "/")
        # Its manager comes with its plugin, which is made after the model.
        none = "'/joint_state_controller' isn't loaded (there are none)"
        self.assertTrue(wait_until(lambda: none in ready.missing(), PATIENCE, "a manager"))
        self.assertTrue(ros_controllers.load_controller_srv(ALL[0]))
        self.assertIn("'/joint_state_controller' is initialized, not running; start it with: rosrun "
                      "controller_manager controller_manager start", ready.missing())  # fmt: skip

        def refusal():  # on a busy machine it may be that a service gives no answer in time
            with self.assertRaises(NotReady) as refused:
                ready.wait(0.1)
            return str(refused.exception)

        words = "not ready after 0.1 s: the controller"
        self.assertTrue(wait_until(lambda: words in refusal(), PATIENCE, "the controller"))
        self.assertTrue(ros_controllers.start_controllers_srv(ALL[:1]))
        self.assertIn(f"'/{CART}' isn't loaded", ready.missing())

    def test_a_robot_that_is_spawned_is_ready(self):
        self.empty_world()
        files = ("cartpole", "cartpole.urdf.xacro", "joint_position_control.yaml")
        options = {"controllers_pkg": "cartpole_controller", "timeout": PATIENCE, "ready": True}
        spawn = partial(ros_spawn.spawn_model_in_gazebo, *files, **options)
        self.assertTrue(spawn(ALL, gazebo_name="cartpole"))
        self.assertEqual(Ready(["cartpole"], ALL).missing(), "")
        answer, text = said(spawn, [*ALL, "none"], gazebo_name="second")
        self.assertFalse(answer)
        self.assertIn("load_controller (none)", text)

    def test_an_environment_says_what_has_gone_and_what_mends_it(self):
        """With the test's own master, which is that of this process's node."""
        started = ros_launch.ros_launch_from_pkg(
            "cartpole", "simulation.launch", launch_new_term=False, timeout=PATIENCE, ready=READY
        )
        self.assertTrue(started)
        self.addCleanup(started.close)
        env = gymnasium.make("cartpole/Classic-v0", backend="ros")
        env.reset(seed=0)
        env.step(0)
        self.assertTrue(ros_controllers.stop_controllers_srv([CART]))
        mend = f"rosrun controller_manager controller_manager start {CART}"
        with self.assertRaisesRegex(SimulatorError, mend):
            env.step(0)
        with self.assertRaisesRegex(StepRefused, mend):
            StepClient().step(1, {CART: 0.0})
        with self.assertRaisesRegex(StepRefused, "is loaded.*rosrun controller_manager spawner no"):
            StepClient().step(1, {"no": 0.0})
        self.assertTrue(ros_controllers.start_controllers_srv([CART]))
        self.assertTrue(ros_gazebo.gazebo_delete_model("cartpole"))
        with self.assertRaisesRegex(SimulatorError, "there is no model 'cartpole'"):
            env.reset(seed=0)
        env.close()

    def spawn(self, name, namespace):
        found = ros_gazebo.gazebo_spawn_urdf_pkg(
            "cartpole", "cartpole.urdf.xacro", model_name=name, robot_namespace=namespace,
            timeout=PATIENCE, verify=True,
        )  # fmt: skip
        self.assertTrue(found)

    @contextlib.contextmanager
    def roscore(self, uri):
        with unittest.mock.patch.dict(os.environ, ROS_MASTER_URI=uri, ROS_IP="127.0.0.1"):
            started = ros_node.ros_node_from_pkg(
                "topic_tools", "relay", launch_master=True, launch_master_term=False,
                launch_new_term=False, args="a b", timeout=PATIENCE,
            )  # fmt: skip
            self.assertTrue(started)
            try:
                yield
            finally:
                ros_node.ros_kill_all_processes()


if __name__ == "__main__":
    rostest.rosrun("cartpole", "readiness", Readiness)
