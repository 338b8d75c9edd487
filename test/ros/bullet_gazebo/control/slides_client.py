"""A client of the robot `slides` and its controller manager in a lock-step world."""

import rospy
from support.ros.calls import gazebo, step_world, wait_until
from support.ros.manager import Manager
from support.ros.world_case import WorldCase


class SlidesTest(WorldCase):
    """Spawns the robot for each test."""

    manager = Manager("/slides")

    def setUp(self):
        gazebo("reset_simulation")
        self.spawn_robot()

    def spawn_robot(self):
        self.spawn("slides", rospy.get_param("/slides/robot_description"), "")

    def run_controllers(self, *names):
        self.assertTrue(self.manager.start(*names), names)

    def state(self, name):
        return self.manager.states()[name]

    def step(self, ticks, **commands):
        """Lets time pass; returns {joint: (position, velocity, effort)}."""
        states = step_world(ticks, controllers=list(commands), commands=list(commands.values())).joint_states
        found = zip(states.position, states.velocity, states.effort, strict=True)
        return dict(zip(states.name, found, strict=True))

    def publish_until(self, publisher, message, condition):
        """Publishes a command, and lets single ticks pass until it shows."""
        publisher.publish(message)
        self.assertTrue(wait_until(lambda: condition(self.step(1))))
