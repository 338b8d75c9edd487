#!/usr/bin/env python3
"""The conformance suite of the environments over ROS, in lock-step or in real time."""

import os
import signal
import sys
import unittest
from unittest import mock

import gymnasium
import numpy as np
import rosservice
import rostest
from support.robots.cartpole import IDS, RICH
from support.ros.calls import process_of

import cartpole  # noqa: F401 - registers the environments
from cartpole.robot import CONTROLLER
from robot_envs.backends.ros import realtime
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.testing import check_robot_env, differences, rollout
from ros_utils import ros_gazebo

BACKEND = next((argument for argument in sys.argv if argument in ("ros", "ros-realtime")), "ros")
REALTIME = BACKEND == "ros-realtime"


class Conformance(unittest.TestCase):
    def test_they_keep_what_environments_of_robots_promise(self):
        kinds = {IDS[0]: RICH} if REALTIME else {IDS[0]: RICH, IDS[2]: {}}  # of each kind of actions
        for identifier, options in kinds.items():
            with self.subTest(identifier, options=options):
                check_robot_env(identifier, (BACKEND,), options=options, steps=30)


class Killed(unittest.TestCase):
    def test_a_simulator_that_is_killed_is_an_error_and_the_next_environment_starts_another(self):
        env = gymnasium.make("cartpole/Classic-v0", backend=BACKEND)
        env.reset(seed=1)
        os.kill(process_of(), signal.SIGKILL)
        for call in (lambda: env.step(1), env.reset):
            with self.assertRaisesRegex(SimulatorError, "its node has ended"):
                call()
        env.close()
        with gymnasium.make("cartpole/Classic-v0", backend=BACKEND) as another:
            self.assertTrue(np.isfinite(another.reset(seed=1)[0]).all())
            another.step(1)


class Lockstep(unittest.TestCase):
    """Against the environment in this process."""

    def setUp(self):
        if REALTIME:
            self.skipTest("time runs by itself")

    def test_the_bits_are_those_of_the_environment_in_process(self):
        for identifier, options in zip(IDS, ({}, {}, RICH | {"control_period": 0.005}), strict=True):
            with self.subTest(identifier):
                runs = []
                for backend in ("ros", "bullet"):
                    env = gymnasium.make(identifier, backend=backend, max_steps=120, **options)
                    runs.append(rollout(env, 300, seed=8))
                    env.close()
                self.assertEqual(differences(*runs), "")

    def test_a_step_that_was_begun_is_over_before_another_environments_reset(self):
        first, second = (gymnasium.make("cartpole/Classic-v0", backend="ros") for _ in range(2))
        first.reset(seed=1)
        first.unwrapped.begin_step(1)
        with gymnasium.make("cartpole/Classic-v0") as alone:
            self.assertEqual(differences(rollout(alone, 50, 2), rollout(second, 50, 2)), "")
        with self.assertRaisesRegex(SimulatorError, "another environment of this process"):
            first.step(1)
        first.close()
        second.close()

    def test_a_closed_environment_leaves_no_snapshots_in_the_simulator(self):
        last = gymnasium.make("cartpole/Classic-v0", backend="ros")  # keeps the simulator
        for _ in range(2):  # which keeps 1000 snapshots
            env = gymnasium.make("cartpole/Classic-v0", backend="ros").unwrapped
            env.reset(seed=1)
            kept = [env.save_state() for _ in range(600)]
            env.restore_state(kept[0])
            env.close()
        last.close()

    def test_the_control_period_counts_the_simulators_own_steps(self):
        env = gymnasium.make("cartpole/Balance-v0", backend="ros")
        ros_gazebo.gazebo_set_time_step(0.004)
        try:
            with self.assertRaisesRegex(ValueError, r"0.006 s is not a multiple .* 0.004 s"):
                gymnasium.make("cartpole/Balance-v0", backend="ros", control_period=0.006)
        finally:
            ros_gazebo.gazebo_set_time_step(0.001)
            env.close()

    def test_a_simulator_of_the_other_kind_is_refused(self):
        gymnasium.make("cartpole/Balance-v0", backend="ros").close()
        with self.assertRaisesRegex(RobotEnvError, "moves in lock-step"):
            gymnasium.make("cartpole/Balance-v0", backend="ros-realtime")


class Realtime(unittest.TestCase):
    """What real time asks of the simulator, and how much of it passes."""

    def setUp(self):
        if not REALTIME:
            self.skipTest("time moves when asked to")

    def test_it_needs_nothing_but_gazebos_own_services(self):
        env = gymnasium.make("cartpole/Balance-v0", backend="ros-realtime")
        env.reset(seed=0)
        env.step(1)
        self.assertNotIn("/gazebo/step_world", rosservice.get_service_list())
        env.close()

    def test_actions_get_their_control_period_at_least(self):
        env = gymnasium.make("cartpole/Balance-v0", backend="ros-realtime", control_period=0.05)
        env.reset(seed=0)
        begin = ros_gazebo.gazebo_get_model_state("cartpole")[0].stamp.to_sec()
        for _ in range(10):  # not env.step: where actions take long, the pole falls sooner
            env.unwrapped.backend.act({CONTROLLER: 0.0})
        end = ros_gazebo.gazebo_get_model_state("cartpole")[0].stamp.to_sec()
        self.assertGreaterEqual(end - begin, 0.49)
        env.close()

    def test_a_control_period_longer_than_the_patience_is_waited_for(self):
        env = gymnasium.make("cartpole/Balance-v0", backend="ros-realtime", control_period=0.5)
        env.reset(seed=0)
        backend = env.unwrapped.backend
        backend.act({CONTROLLER: 0.0})
        begin = ros_gazebo.gazebo_get_model_state("cartpole")[0].stamp.to_sec()
        with mock.patch.object(realtime, "STATE_TIMEOUT", 0.1):  # joint states come every 20 ms
            backend.act({CONTROLLER: 0.0})
        end = ros_gazebo.gazebo_get_model_state("cartpole")[0].stamp.to_sec()
        self.assertGreaterEqual(end - begin, 0.45)
        env.close()


if __name__ == "__main__":
    rostest.rosrun("cartpole", "environments", "__main__")
