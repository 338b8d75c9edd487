#!/usr/bin/env python3
"""The pendulum over ROS in a session that its user starts and ends, in lock-step or in real time."""

import sys
import unittest
from dataclasses import replace

import numpy as np
import rostest
from support.robots.pendulum import MOTOR, PENDULUM, make_pendulum
from support.ros.calls import process_of

from robot_envs.backends.in_process import InProcessWorld
from robot_envs.backends.ros.session import RosSession
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.scene import Scene
from robot_envs.testing import differences, rollout
from robot_envs.world_state import InitialState, LinkQuery, Motion, Pose, StateQuery
from ros_utils import ros_gazebo

BACKEND = next((argument for argument in sys.argv if argument in ("ros", "ros-realtime")), "ros")
REALTIME = BACKEND == "ros-realtime"


class SecondRobot(unittest.TestCase):
    """One session, since a process becomes a ROS node once."""

    @classmethod
    def setUpClass(cls):
        cls.said = []
        raised = replace(PENDULUM, pose=Pose((0.0, 0.0, 0.3)), physics_step=0.002)
        cls.scene = Scene([raised])
        cls.session = RosSession(raised, "/learner", [], realtime=REALTIME, gui=False, seed=0)
        cls.addClassCleanup(cls.session.close)
        cls.session.start(cls.said.append)
        cls.simulator = process_of()

    def test_what_was_missing_was_started_and_told(self):
        controllers = "starting joint_state_controller, hinge_effort_controller"
        self.assertEqual(self.said, ["starting the simulator", "spawning the robot 'pendulum'", controllers])
        pose = ros_gazebo.gazebo_get_model_state("pendulum")[1]
        self.assertAlmostEqual(pose.position.z, 0.3)
        self.assertEqual(ros_gazebo.gazebo_get_time_step(), 0.002)

    def test_environments_made_afterwards_use_it_and_start_nothing(self):
        first, second = (make_pendulum(BACKEND, self.scene.robots[0]) for _ in range(2))
        self.assertTrue(first.shares_robot)
        for env in (first, second, first):
            env.reset(seed=1)
            self.assertTrue(np.isfinite(env.step(np.ones(1, np.float32))[0]).all())
        first.close()
        second.reset(seed=1)
        second.step(np.ones(1, np.float32))
        second.close()
        self.assertEqual(process_of(), self.simulator)

    def test_z_closing_ends_the_simulator_and_the_node(self):
        """The last one by its name."""
        self.session.close()
        self.assertIsNone(process_of())
        with self.assertRaisesRegex(RobotEnvError, "a process becomes one only once"):
            make_pendulum(BACKEND, self.scene.robots[0])
        self.assertIsNone(process_of())


@unittest.skipIf(REALTIME, "time runs by itself")
class Lockstep(SecondRobot):
    def test_the_bits_are_those_of_the_robot_in_process(self):
        for options in ({}, {"varied": True, "sensor_noise": {"hinge": (0.01, 0.1)}, "sensor_delay": 2}):
            runs = []
            for backend in ("ros", "bullet"):
                env = make_pendulum(backend, self.scene.robots[0], **options)
                runs.append(rollout(env, 500, seed=8))
                env.close()
            with self.subTest(options):
                self.assertEqual(differences(*runs), "")

    def test_what_is_told_of_the_world_has_the_bits_of_the_robot_in_process(self):
        query = StateQuery(links=(LinkQuery("rod"), LinkQuery("pendulum::rod")), models=("pendulum",))
        turned = {"pendulum": Motion(Pose((0.1, -0.2, 0.4), (0.1, 0.0, 2.0, 0.3)))}
        runs = []
        for backend in (self.session.connect(self.scene, 0.01), InProcessWorld(self.scene, 0.01)):
            self.addCleanup(backend.close)
            backend.reset(InitialState())  # what it told before isn't told any more
            backend.look(query)
            run = []
            for placed in (turned, {}):
                run.append(backend.reset(InitialState({"hinge": (0.3, -0.5)}, placed)))
                run += [backend.act({MOTOR: 0.1 * n}) for n in range(20)]
            runs.append(run)
        self.assertEqual(runs[0], runs[1])
        self.assertEqual(runs[0][-1].time, 0.2)

    def test_what_one_environment_varies_is_taken_back_for_another_one(self):
        """Also where the first one is closed while the other one's episode is under way."""
        robot, action = self.scene.robots[0], np.zeros(1, np.float32)
        alone = make_pendulum("bullet", robot)
        expected = [alone.reset(seed=3)[0], *(alone.step(action)[0] for _ in range(6))]
        alone.close()
        varied, plain = make_pendulum("ros", robot, varied=True), make_pendulum("ros", robot)
        self.addCleanup(plain.close)
        varied.reset(seed=1)
        told = varied.reset(seed=2)[1]["variation"]
        seen = [plain.reset(seed=3)[0], *(plain.step(action)[0] for _ in range(3))]
        varied.close()
        seen += [plain.step(action)[0] for _ in range(3)]
        self.assertTrue(np.array_equal(seen, expected), (seen, expected))
        again = make_pendulum("ros", robot, varied=True)
        self.addCleanup(again.close)
        self.assertTrue(np.array_equal(again.reset(seed=2)[1]["variation"], told))


@unittest.skipUnless(REALTIME, "time moves when asked to")
class Realtime(SecondRobot):
    def test_links_are_told_in_lock_step_only(self):
        robot = self.session.connect(self.scene, 0.01)
        self.addCleanup(robot.close)
        robot.look(StateQuery())
        with self.assertRaisesRegex(RobotEnvError, "in real time gives joints and sensors alone"):
            robot.look(StateQuery(models=("pendulum",)))

    def test_models_are_placed(self):
        robot = self.session.connect(self.scene, 0.01)
        self.addCleanup(robot.close)
        robot.reset(InitialState({"hinge": 0.2}, {"pendulum": Pose((0.1, 0.2, 0.5))}))
        found = ros_gazebo.gazebo_get_model_state("pendulum")[1].position
        self.assertEqual([round(each, 6) for each in (found.x, found.y, found.z)], [0.1, 0.2, 0.5])
        robot.reset(InitialState())
        found = ros_gazebo.gazebo_get_model_state("pendulum")[1].position
        self.assertAlmostEqual(found.z, 0.3)
        with self.assertRaisesRegex(SimulatorError, "model 'ball' can't be placed"):
            robot.reset(InitialState(models={"ball": Pose()}))

    def test_without_a_control_period_it_takes_the_newest_state_and_never_repeats_itself(self):
        env = make_pendulum("ros-realtime", self.scene.robots[0], control_period=0.0)
        self.assertFalse(env.backend.deterministic)
        env.reset(seed=2)
        for _ in range(20):
            observation = env.step(np.zeros(1, np.float32))[0]
            self.assertTrue(np.isfinite(observation).all())
        env.close()

    def test_a_motor_turns_it(self):
        robot = self.session.connect(self.scene, 0.05)
        robot.reset(InitialState())
        states = [robot.act({MOTOR: 0.5}) for _ in range(4)]
        robot.close()
        self.assertEqual(states[-1].commands, {MOTOR: 0.5})
        self.assertGreater(states[-1].time, 0.15)
        self.assertGreater(states[-1].joints["hinge"].position, 0.1)
        self.assertGreater(states[-1].joints["hinge"].velocity, 0.5)


del SecondRobot  # a base of the two, and no test by itself

if __name__ == "__main__":
    rostest.rosrun("cartpole", "second_robot", "__main__")
