"""A robot that isn't fixed to the world: pictures over ROS equal those in-process."""

import tempfile
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np
from support.robots.pendulum import FILES, PENDULUM, Upright

from robot_envs.backends.ros.session import RosSession
from robot_envs.environment import RobotEnv

HULL = """<link name="hull">
  <inertial><mass value="0.3"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
  <visual><geometry><box size="0.3 0.2 0.1"/></geometry></visual></link>"""


def make_robot(folder):
    """The pendulum on a hull that hangs on nothing."""
    text = (FILES / "pendulum.urdf").read_text()
    text = text.replace('<link name="world"/>', HULL)
    text = text.replace('<parent link="world"/>', '<parent link="hull"/>')
    text = text.replace('<origin xyz="0 0 1"/>', '<origin xyz="0 0 0.05"/>')
    path = folder / "free.urdf"
    path.write_text(text)
    return replace(PENDULUM, name="free", urdf=path)


class FreeRobot(unittest.TestCase):
    def test_its_pictures_are_those_of_the_robot_in_process(self):
        robot = make_robot(Path(self.enterContext(tempfile.TemporaryDirectory())))
        session = RosSession(robot, "/learner", [], realtime=False, gui=False, seed=0)
        self.addCleanup(session.close)
        session.start(lambda _: None)
        pictures, places = {}, {}
        for backend in ("ros", "bullet"):
            env = RobotEnv(robot, Upright(), backend, render_mode="rgb_array", width=160, height=120)
            pictures[backend] = []
            env.reset(seed=3)
            for _ in range(4):
                for _ in range(4):
                    env.step(np.ones(1, np.float32))
                pictures[backend].append(env.render())
            places[backend] = env.backend.poses([f"{robot.model}::{robot.links.root}"])[0]
            env.close()
        for ours, theirs in zip(*pictures.values(), strict=True):
            self.assertTrue(np.array_equal(ours, theirs))
        first, *_, last = pictures["ros"]
        self.assertFalse(np.array_equal(first, last))
        self.assertEqual(places["ros"], places["bullet"])
        self.assertLess(places["ros"].position[2], -0.05)  # it falls
        self.assertGreater(abs(places["ros"].orientation[1]), 0.01)  # and turns
