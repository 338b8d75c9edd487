"""A client of the robot `slides` and its controller manager in a lock-step world."""

import unittest

import rospy
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from std_srvs.srv import Empty
from support.ros.calls import call, delete_model, spawn_model, wait_until
from support.ros.manager import Manager
from support.ros.subscribed import Listener


def listen(name, kind):
    """Listens to a topic of the robot."""
    return Listener(rospy.names.ns_join("/slides", name), kind)


class SlidesTest(unittest.TestCase):
    """Spawns the robot for each test."""

    manager = Manager("/slides")

    def setUp(self):
        self.publishers = []
        call("/gazebo/reset_simulation", Empty)
        self.spawn()

    def tearDown(self):
        self.delete()
        for publisher in self.publishers:
            publisher.unregister()

    def spawn(self):
        answer = spawn_model("slides", rospy.get_param("/slides/robot_description"), "")
        self.assertTrue(answer.success, answer.status_message)

    def delete(self):
        delete_model("slides")

    def run_controllers(self, *names):
        self.assertTrue(self.manager.start(*names), names)

    def state(self, name):
        return self.manager.states()[name]

    def step(self, ticks, **commands):
        """Lets time pass; returns {joint: (position, velocity, effort)}."""
        request = StepWorldRequest(
            ticks=ticks, controllers=list(commands), commands=list(commands.values())
        )
        answer = call("/gazebo/step_world", StepWorld, request)
        self.assertTrue(answer.success, answer.status_message)
        states = answer.joint_states
        found = zip(states.position, states.velocity, states.effort, strict=True)
        return dict(zip(states.name, found, strict=True))

    def publisher(self, topic, kind):
        """A publisher that has found its subscriber."""
        publisher = rospy.Publisher(f"/slides/{topic}", kind, queue_size=1)
        self.publishers.append(publisher)
        self.assertTrue(wait_until(lambda: publisher.get_num_connections() > 0), topic)
        return publisher

    def publish_until(self, publisher, message, condition):
        """Publishes a command, and lets single ticks pass until it shows."""
        publisher.publish(message)
        self.assertTrue(wait_until(lambda: condition(self.step(1))))
