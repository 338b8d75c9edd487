"""Scenes over ROS in lock-step, one after the other: two arms with a ball, a rover with a crate."""

import tempfile
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np
from support.scenes.rover import ROVER, Push
from support.scenes.two_arms import LEFT, RIGHT, Volley

from robot_envs import InitialState, Pose, RobotEnv, RobotEnvError, SimulatorError
from robot_envs.backends.ros import running
from robot_envs.testing import check_robot_env, differences, rollout


def models():
    """What is in the simulator's world."""
    return set(running.models())


class Scenes:
    """The tests. All environments of the same robots share one simulator, which the first one starts."""

    def make(self, backend="ros", task=None, **options):
        made = RobotEnv(self.robots, task or self.task(), backend=backend, **options)
        self.addCleanup(made.close)
        return made

    def test_the_bits_are_those_of_the_world_in_process(self):
        over_ros, here = self.make(), self.make("bullet")
        for seed in (7, 8):  # the second time after other episodes
            self.assertEqual(differences(rollout(over_ros, 130, seed), rollout(here, 130, seed)), "")


class Arms(Scenes, unittest.TestCase):
    robots = (LEFT, RIGHT)

    def task(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        return Volley(Path(folder))

    def test_it_keeps_what_environments_of_robots_promise(self):
        check_robot_env(lambda **options: RobotEnv(self.robots, self.task(), **options), ("ros",), steps=30)

    def test_pictures_show_the_same_as_of_the_world_in_process(self):
        pictures = []
        for backend in ("ros", "bullet"):
            env = self.make(backend, render_mode="rgb_array", width=160, height=80)
            env.action_space.seed(1)
            env.reset(seed=1)
            for _ in range(10):
                env.step(env.action_space.sample())
            pictures.append(env.render())
            env.close()
        self.assertTrue(np.array_equal(*pictures))

    def test_objects_go_with_the_last_environment_that_has_them(self):
        names = {each.name for each in self.task().objects}
        first, second = self.make(), self.make()
        self.assertLessEqual(names, models())
        for env in (first, second):
            env.reset(seed=0)
        first.close()
        self.assertLessEqual(names, models())
        second.close()
        self.assertFalse(names & models())

    def test_the_world_has_the_objects_of_whoever_begins_an_episode(self):
        """Of two tasks that differ in where a thing of the same name is, and in another one."""
        first = self.make()
        task = self.task()
        thing = task.objects[0]
        task.objects = (
            replace(task.objects[0], pose=Pose((0.0, 0.0, 5.0))),
            *task.objects[1:],
            replace(thing, name="another", pose=Pose((1.0, 1.0, 0.5))),
        )
        expected = [rollout(self.make("bullet", each), 20, seed=2) for each in (self.task(), task)]
        first.reset(seed=0)
        before = models()
        second = self.make(task=task)
        self.assertEqual(models(), before)  # the first one's episode goes on
        first.step(first.action_space.sample())
        for env, wanted in ((second, 1), (first, 0), (second, 1)):
            self.assertEqual(differences(rollout(env, 20, seed=2), expected[wanted]), "")
            self.assertEqual("another" in models(), env is second)
        with self.assertRaisesRegex(SimulatorError, "another environment of this process"):
            first.step(first.action_space.sample())
        second.close()
        self.assertNotIn("another", models())
        self.assertEqual(differences(rollout(first, 20, seed=2), expected[0]), "")

    def test_wrong_names_are_told_with_the_nearest(self):
        env = self.make()
        with self.assertRaisesRegex(SimulatorError, "no model 'bxll'"):
            env.reset(options={"initial_state": InitialState(models={"bxll": Pose()})})
        near = next(iter(env.scene.joints))
        with self.assertRaisesRegex(ValueError, f"to place; did you mean '{near}'"):
            env.reset(options={"initial_state": InitialState(joints={near[:-1]: 0.0})})


class Rover(Scenes, unittest.TestCase):
    """After the arms: their simulator, whose world is another one, has ended."""

    robots = (ROVER,)

    def task(self):
        return Push()

    def test_other_robots_have_to_wait_until_environments_are_closed(self):
        first = self.make()
        first.reset(seed=0)
        other = replace(ROVER, name="other")
        with self.assertRaisesRegex(RobotEnvError, r"of 'rover' is open; close\(\) it first"):
            RobotEnv(other, Push(), "ros")
        first.step(first.action_space.sample())
