"""The robot `slides` in a lock-step world, as a client of its controller manager sees it."""

import sys
import threading
import unittest
from pathlib import Path

import rospy
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from controller_manager_msgs.srv import (
    ListControllers,
    ListControllerTypes,
    LoadController,
    SwitchController,
    UnloadController,
)
from gazebo_msgs.srv import DeleteModel, SpawnModel, SpawnModelRequest
from std_srvs.srv import Empty

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))
from support.ros.subscribed import wait_until_heard

BOUND = 60.0  # [s of wall time]
STRICT = 2
MANAGER = "/slides/controller_manager/"


def call(name, kind, *args):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind)(*args)


def wait_until(condition, bound=BOUND):
    pause = threading.Event()
    for _ in range(int(bound / 0.01)):
        if condition():
            return True
        pause.wait(0.01)
    return False


class Topic:
    """Keeps what comes on a topic of the robot."""

    def __init__(self, name, kind):
        self.messages = []
        topic = rospy.names.ns_join("/slides", name)
        self._subscriber = rospy.Subscriber(topic, kind, self.messages.append)
        assert wait_until_heard(topic), name

    def wait_for(self, condition):
        return wait_until(lambda: condition(self.messages))

    def close(self):
        self._subscriber.unregister()


class SlidesTest(unittest.TestCase):
    """Spawns the robot for each test."""

    def setUp(self):
        self.publishers = []
        call("/gazebo/reset_simulation", Empty)
        self.spawn()

    def tearDown(self):
        self.delete()
        for publisher in self.publishers:
            publisher.unregister()

    def spawn(self):
        xml = rospy.get_param("/slides/robot_description")
        request = SpawnModelRequest(model_name="slides", model_xml=xml)
        answer = call("/gazebo/spawn_urdf_model", SpawnModel, request)
        self.assertTrue(answer.success, answer.status_message)

    def delete(self):
        call("/gazebo/delete_model", DeleteModel, "slides")

    def load(self, name):
        return call(MANAGER + "load_controller", LoadController, name).ok

    def unload(self, name):
        return call(MANAGER + "unload_controller", UnloadController, name).ok

    def switch(self, start=(), stop=(), strictness=STRICT):
        return call(
            MANAGER + "switch_controller", SwitchController, start, stop, strictness, False, 0.0
        ).ok

    def run_controllers(self, *names):
        for name in names:
            self.assertTrue(self.load(name), name)
        self.assertTrue(self.switch(names))

    def listed(self):
        return call(MANAGER + "list_controllers", ListControllers).controller

    def types(self):
        return call(MANAGER + "list_controller_types", ListControllerTypes).types

    def state(self, name):
        return {each.name: each.state for each in self.listed()}[name]

    def step(self, ticks, **commands):
        """Lets time pass; returns {joint: (position, velocity, effort)}."""
        request = StepWorldRequest(
            ticks=ticks, controllers=list(commands), commands=list(commands.values())
        )
        answer = call("/gazebo/step_world", StepWorld, request)
        self.assertTrue(answer.success, answer.status_message)
        states = answer.joint_states
        return dict(
            zip(
                states.name,
                zip(states.position, states.velocity, states.effort, strict=True),
                strict=True,
            )
        )

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
