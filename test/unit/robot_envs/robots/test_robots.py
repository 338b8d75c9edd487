"""The robots that come along: their files, and that their environments are what Gymnasium wants."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.python import run_python

import robot_envs.robots  # noqa: F401 - registers the environments
from robot_envs.making import named
from robot_envs.testing import check_robot_env, rollout

ROOT = Path(__file__).resolve().parents[4]
IDS = sorted(each for each in gymnasium.registry if each.startswith("robot_envs/"))
assert IDS  # pytest skips what is parametrised over nothing


def test_registering_them_loads_neither_their_files_nor_a_physics_engine() -> None:
    code = (
        "import robot_envs.robots, sys;"
        "print([each for each in sys.modules if 'pybullet' in each or 'robots.' in each])"
    )
    assert run_python(code).stdout == "[]\n"


@pytest.mark.parametrize("identifier", IDS)
class TestEach:
    @pytest.mark.slow
    def test_it_keeps_what_environments_promise(self, identifier: str) -> None:
        check_robot_env(identifier, steps=20 if "Images" in identifier else 40 if "Nav" in identifier else 70)

    def test_its_description_is_sound_and_names_all_that_its_task_asks_for(self, identifier: str) -> None:
        made = gymnasium.registry[identifier].kwargs
        robot, task = named(made["robot"]), named(made["task"])()
        robot.check()
        assert robot.links.warnings == []
        links = {*robot.links.links, *robot.links.lumped}
        assert {each.link for each in task.query.links} <= links
        assert set(task.query.contacts_of) <= links

    def test_every_number_of_an_action_does_something(self, identifier: str) -> None:
        env = gymnasium.make(identifier)
        size = env.action_space.shape[0]
        ends = []
        for action in (np.zeros(size), *np.eye(size)):
            env.reset(seed=3)
            for _ in range(3):
                env.step(action.astype(np.float32))
            ends.append([j.position for j in env.unwrapped._state.joints.values()])
        for end in ends[1:]:
            assert np.abs(np.subtract(end, ends[0])).max() > 1e-3
        env.close()

    def test_observations_are_of_order_one(self, identifier: str) -> None:
        env = gymnasium.make(identifier)
        for given in rollout(env, 200, 1):
            parts = given[0].values() if isinstance(given[0], dict) else given[:1]
            assert all(np.abs(part).max() <= 10.0 for part in parts)
        env.close()

    @pytest.mark.slow
    def test_pictures_show_the_whole_robot(self, identifier: str) -> None:
        """Its colours are there, and nothing of them is cut off at an edge."""
        env = gymnasium.make(identifier, render_mode="rgb_array", width=160, height=120)
        env.reset(seed=3)  # no coloured box stands before the rover
        picture = env.render().astype(int)
        env.close()
        coloured = picture.max(axis=2) - picture.min(axis=2) > 60
        assert coloured.sum() > 40
        edge = np.ones_like(coloured)
        edge[2:-2, 2:-2] = False
        assert not (coloured & edge).any()
