#!/usr/bin/env python3
"""policy_node.py on the cart-pole in real time: it balances, and stops at late states and at Ctrl-C."""

import os
import signal
import threading
import time
import unittest

import rospy
import rostest
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty
from support.ros.programs import Place, Process
from support.ros.subscribed import wait_until_heard
from support.training import training_runs

import cartpole  # noqa: F401 - registers the environments
from rl_workbench import cli
from ros_utils import ros_controllers, ros_gazebo
from ros_utils.readiness import Ready

BOUND = 180.0  # [s of wall time] for anything
STATES, CONTROLLER = "joint_state_controller", "stand_cart_position_controller"
COMMAND = f"/{CONTROLLER}/command"
READY = Ready(["cartpole"], [STATES, CONTROLLER])
SLOWLY = 0.3  # of real time: a busy machine is in time as well
UPRIGHT, LONG = 0.2, 1.5  # [rad], [s of simulated time]
PUSHED = [0.0, 0.04]  # [m], [rad]: held as it is, the cart's pole is down within a second
TRAINING = {
    "env_id": "cartpole/Balance-v0", "env_kwargs": {"noise": 0.05, "max_steps": 500}, "seed": 1,
    "episodes": 300, "stop_at_length": 200, "eval_frequency": 0, "eval_episodes": 1,
    "observation_scale": "0.4,1.0,0.2,2.0", "policy_learning_rate": 0.03,
    "value_learning_rate": 0.01, "value_epochs": 20,
}  # fmt: skip
MOVES, LATE = "the policy moves the robot", "no joint state on /joint_states for 1 s"
BEYOND, OVER = "beyond its stops at -0.5 and 0.5", "an episode would be over here"
AGAIN, STOPPED = "continuing", "the robot is stopped"


class PolicyNode(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("policy_on_robot")
        cls.place = Place(os.environ["ROS_MASTER_URI"])
        cls.addClassCleanup(cls.place.close)
        READY.wait(BOUND)
        assert ros_gazebo.gazebo_set_max_update_rate(SLOWLY)  # it runs while we train
        training_runs.run(training_runs.options_of("reinforce", TRAINING), cls.place.run)
        cls.exported = cls.place.folder / "policy.pt"
        assert cli.main(["export", str(cls.place.run), "--out", str(cls.exported)]) == 0

    def setUp(self):
        self.news = threading.Condition()
        self.joints, self.commands = [], []  # (time, cart, pole); numbers
        for subscriber in (
            rospy.Subscriber("/joint_states", JointState, self.take_joints, queue_size=None),
            rospy.Subscriber(COMMAND, Float64, self.take_command, queue_size=None),
        ):
            self.addCleanup(subscriber.unregister)

    def take_joints(self, message):
        found = dict(zip(message.name, message.position, strict=True))
        with self.news:
            at = message.header.stamp.to_sec()
            self.joints.append((at, found["stand_cart"], found["cart_pole"]))
            self.news.notify_all()

    def take_command(self, message):
        with self.news:
            self.commands.append(message.data)
            self.news.notify_all()

    def eventually(self, what, holds):
        with self.news:
            self.assertTrue(self.news.wait_for(holds, BOUND), f"{what}:\n{self.node.output}")

    def start(self, policy) -> Process:
        command = ("rosrun", "cartpole", "policy_node.py", str(policy), "--late=1")
        self.node = self.place.start(*command)
        self.addCleanup(lambda: (self.node.send(signal.SIGKILL), self.node.end()))
        self.node.wait_for(MOVES, BOUND)
        self.assertTrue(wait_until_heard("/joint_states", COMMAND))
        return self.node

    def push(self):
        joints = ["stand_cart", "cart_pole"]
        self.assertTrue(ros_gazebo.gazebo_set_model_configuration("cartpole", joints, PUSHED))

    def stays_upright(self) -> bool:
        """Whether it does, from a push on."""
        self.push()
        with self.news:
            self.joints.clear()

        def has_fallen():
            return any(abs(pole) > UPRIGHT for _, _, pole in self.joints)

        self.eventually(
            "joint states",
            lambda: self.joints and (has_fallen() or self.joints[-1][0] - self.joints[0][0] > LONG),
        )
        return not has_fallen()

    def ends_with_a_stop(self, code):
        """At a position at which the cart was, and nothing after it."""
        self.assertEqual(self.node.end(BOUND), code, self.node.output)
        self.assertIn(STOPPED, self.node.output.splitlines()[-1])
        self.eventually(
            "the last command is where the cart was",
            lambda: (
                self.commands[-1:] == self.commands[-2:-1]
                and any(cart == self.commands[-1] for _, cart, _ in self.joints)
            ),
        )

    def test_a_trained_policy_balances_the_pole_until_ctrl_c(self):
        node = self.start(self.place.run)
        self.assertTrue(any(self.stays_upright() for _ in range(5)), node.output)
        second = self.place.start("rosrun", "cartpole", "policy_node.py", str(self.exported))
        self.assertEqual(second.end(BOUND), 1)
        *_, line = second.output.splitlines()  # after the one that names the policy
        self.assertRegex(line, "^policy_node.py: a node /policy_node runs at .* already")
        node.interrupt()
        self.ends_with_a_stop(130)

    def test_it_stops_while_states_are_late_and_goes_on_with_them(self):
        """With the exported policy."""
        node = self.start(self.exported)
        self.assertNotIn(LATE, node.output)
        self.assertTrue(ros_controllers.stop_controllers_srv([STATES]))
        node.wait_for(LATE, BOUND)
        with self.news:
            self.commands.clear()
        self.eventually("the same command", lambda: len(self.commands) > 20)
        with self.news:
            self.assertEqual(len(set(self.commands[5:])), 1)  # some were on their way
            held = self.commands[-1]
            self.assertTrue(any(cart == held for _, cart, _ in self.joints))
        self.assertEqual(node.output.count(LATE), 1)
        self.assertTrue(ros_controllers.start_controllers_srv([STATES]))
        node.wait_for(OVER, BOUND)  # it has fallen meanwhile
        self.push()
        node.wait_for(AGAIN, BOUND)
        self.assertTrue(ros_gazebo.gazebo_reset_sim())
        with self.news:
            self.commands.clear()
        self.eventually("commands after a reset of the time", lambda: len(self.commands) > 20)
        # What it prints may come later than what it publishes.
        self.eventually(MOVES, lambda: node.output.count(MOVES) == 2)
        node.send(signal.SIGTERM)
        self.ends_with_a_stop(143)

    def test_it_stops_at_a_state_that_cannot_be_and_while_its_controller_is_stopped(self):
        node = self.start(self.exported)
        source = rospy.Publisher("/joint_states", JointState, queue_size=1)
        self.addCleanup(source.unregister)
        bad = JointState(name=["stand_cart"], position=[50.0], velocity=[0.0], effort=[0.0])
        deadline = time.monotonic() + BOUND
        while BEYOND not in node.output and time.monotonic() < deadline:
            source.publish(bad)  # again, as the simulator's next good state takes its place
            self.push()
        node.wait_for(BEYOND, BOUND)
        node.wait_for(AGAIN, BOUND)
        self.assertTrue(ros_controllers.stop_controllers_srv([CONTROLLER]))
        node.wait_for(f"'/{CONTROLLER}' is stopped, not running", BOUND)
        before, deadline = node.output.count(AGAIN), time.monotonic() + BOUND
        self.assertTrue(ros_controllers.start_controllers_srv([CONTROLLER]))
        while node.output.count(AGAIN) == before and time.monotonic() < deadline:
            self.push()  # again, as the pole falls until the node knows that the controller runs
        self.eventually("continuing", lambda: node.output.count(AGAIN) > before)
        with self.news:
            self.assertTrue(all(abs(each) <= 0.5 for each in self.commands))
        node.send(signal.SIGTERM)
        self.assertEqual(node.end(BOUND), 143, node.output)

    def test_waiting_for_a_simulator_in_lockstep_is_told(self):
        """Joint states that don't come, and the service that tells why."""
        service = rospy.Service("/gazebo/step_world", Empty, lambda _: None)
        self.addCleanup(service.shutdown)
        self.assertTrue(ros_controllers.stop_controllers_srv([STATES]))
        self.addCleanup(ros_controllers.start_controllers_srv, [STATES])
        node = self.place.start("rosrun", "cartpole", "policy_node.py", str(self.exported))
        node.wait_for("lockstep:=false", BOUND)
        told = "waiting for the state of .* on /joint_states; the simulator is in lock-step"
        self.assertRegex(node.output, f"{told}.*lockstep:=false")
        node.interrupt()
        self.assertEqual(node.end(BOUND), 130, node.output)

    def test_a_training_in_real_time_is_refused_with_the_remedy(self):
        run = self.place.folder / "refused"
        training = self.place.start("rosrun", "cartpole", "pg_train.py", f"--run-dir={run}")
        self.assertEqual(training.end(), 1)
        self.assertIn("lockstep:=true", training.output)
        self.assertIn("--realtime", training.output)
        self.assertFalse(run.exists())


if __name__ == "__main__":
    rostest.rosrun("cartpole", "policy_on_robot", PolicyNode)
