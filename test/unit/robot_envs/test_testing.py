"""The conformance suite finds each fault that it is there for, and says what was seen and expected."""

import sys
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box
from support.python import run
from support.scenes import broken
from support.scenes.broken import of, wobbling
from support.scenes.rover import ROVER, Push
from support.scenes.solo_arm import SOLO, Hold, Reach

from robot_envs import GoalTask, RobotEnv, register
from robot_envs.testing import check_robot_env, episodes, repetition, suite
from robot_envs.testing.rollouts import Subject

STEPS = 12


@pytest.mark.slow
@pytest.mark.parametrize("task", [Hold, Reach, wobbling])
def test_sound_environments_pass(task):
    check_robot_env(of(task), steps=STEPS)


def test_without_asserts_it_checks_nothing_and_says_so():
    text = "from robot_envs.testing import check_robot_env; check_robot_env('any')"
    told = run([sys.executable, "-O", "-c", text]).stderr
    assert "RuntimeError: check_robot_env checks by assert" in told


@pytest.mark.slow
def test_so_does_a_rover_that_pushes_something():
    check_robot_env(lambda **options: RobotEnv(ROVER, Push(), **options), steps=STEPS)


@pytest.mark.slow
def test_so_does_one_with_an_id_and_options():
    register("suite/Reach-v0", "support.scenes.solo_arm:SOLO", "support.scenes.solo_arm:Reach")
    options = {"sensor_noise": 0.01, "sensor_delay": 2, "action_delay": 1}
    check_robot_env("suite/Reach-v0", options=options, steps=STEPS)
    with pytest.raises(AssertionError, match="NameNotFound: Environment `Rich` doesn't exist"):
        check_robot_env("suite/Rich-v0")


def swallows(**options: Any) -> RobotEnv:
    known = ("backend", "max_steps", "render_mode", "width", "height")
    return RobotEnv(SOLO, Hold(), **{name: options[name] for name in known if name in options})


SMALL = Box(-1e-6, 1e-6, (2,), np.float32)
FAULTS = {
    "outside": (episodes.observations, of(lambda: Hold(observation_space=lambda: SMALL)),
        r"observation 1 of a rollout isn't in the observation space: entry \d is .*, and not in"),
    "kept": (episodes.observations_are_new, of(lambda: broken.kept(Hold())),
        "observe\\(\\) must make a new array each time"),
    "no cut": (episodes.ends, of(Hold, broken.NoCut),
        "an episode with max_steps=1 continues after its first step"),
    "both ends": (episodes.ends, of(Hold, broken.BothEnds), "an episode is terminated and truncated at once"),
    "goes on": (episodes.ends, of(Hold, broken.GoesOn),
        "step\\(\\) behind an episode's end raises nothing, and not ResetNeeded"),
    "no reset": (episodes.beginnings, of(Hold, broken.NeedsNoReset),
        "before the first reset\\(\\) raises nothing, and not ResetNeeded"),
    "any option": (episodes.beginnings, of(Hold, broken.TakesAnyOption),
        "with an option that doesn't exist raises nothing, and not ValueError"),
    "begins anywhere": (episodes.beginnings, of(Hold, broken.BeginsWhereItLikes),
        "reset\\(\\) to the same initial_state gives joints"),
    "clips": (episodes.wrong_actions, of(Hold, broken.Clips),
        r"step\(\) with the action array\(\[nan, nan\].* raises nothing, and not ValueError"),
    "moves first": (episodes.wrong_actions, of(wobbling, broken.MovesFirst),
        "a refused action has moved something: step 1: the observation is"),
    "swallows options": (episodes.wrong_options, swallows,
        "making it with the options {'no_such_option': 1} raises nothing"),
    "never closes": (episodes.closed, of(Hold, broken.NeverCloses),
        "behind close\\(\\) raises error \\(Not connected to physics server.\\), not ClosedEnvironmentError"),
    "one picture": (episodes.pictures, of(Hold, broken.OnePicture), "pictures of 12 steps are all the same"),
    "miscounts": (episodes.goals, of(Reach, broken.Miscounts),
        "step\\(\\) gave the reward -?\\d.5, and compute_reward\\(\\) of its goals gives"),
    "forgets": (episodes.goals, of(Reach, broken.Forgets), "has the desired goal"),
    "one by one": (episodes.goals, of(broken.OneByOne),
        "compute_reward\\(\\) of \\d+ goals at once gives the shape \\(\\), and not"),
    "never there": (episodes.goals, of(broken.NeverThere),
        "is_success\\(\\) of goals that were achieved as they were desired gives"),
    "far goals": (episodes.goals, of(broken.FarGoals), "achieved_goal isn't in the space of goals: entry"),
    "draws": (repetition.seeding, of(lambda: broken.drawing(Hold())),
        "give other bits the second time: the reset after 0 steps: the observation is"),
    "counts": (repetition.seeding, of(lambda: broken.counting(Hold())),
        "the same seed and actions give other bits"),
    "deaf": (suite.gymnasiums_checker, of(wobbling, broken.Deaf), "seed"),
}  # fmt: skip


@pytest.mark.parametrize("case", FAULTS)
def test_a_fault_is_found_and_told(case):
    check, make, text = FAULTS[case]
    with pytest.raises(AssertionError, match=text):
        check(Subject(make, steps=STEPS))


def test_backends_that_differ_are_told_with_the_step():
    def make(backend: str) -> RobotEnv:
        return RobotEnv(SOLO, Hold(reward=lambda *_: 0.0 if backend == "one" else 1.0))

    one, other = (Subject(make, steps=STEPS).over(name) for name in ("one", "other"))
    with pytest.raises(AssertionError, match="one and other .*: step 1: the reward is 0.0 and"):
        repetition.backends(one, other)


def test_a_vector_that_gives_something_else_is_told():
    made: list[Any] = []

    class Jealous(RobotEnv):
        """Gives more where there are several."""

        def __init__(self, *args: Any, **options: Any) -> None:
            super().__init__(*args, **options)
            made.append(self)

        def close(self) -> None:
            if self in made:
                made.remove(self)
            super().close()

        def step(self, action: Any) -> Any:
            seen, reward, *rest = super().step(action)
            return seen, reward + (len(made) > 2), *rest

    with pytest.raises(AssertionError, match=r"environment 0 of 3 in a vector \(SyncVectorEnv\)"):
        repetition.vectors(Subject(of(Hold, Jealous), steps=STEPS))


def test_a_spec_that_cannot_be_sent_is_told():
    identifier = "suite/Stuck-v0"
    gymnasium.register(identifier, partial(of(Hold)), kwargs={})
    with pytest.raises(AssertionError, match="its spec can't be copied and sent"):
        repetition.specification(Subject(partial(gymnasium.make, identifier), {}, identifier))


def test_a_task_that_says_less_than_it_should_is_no_goal_task():
    class Claims(RobotEnv):
        def compute_reward(self, *_: Any) -> float:
            return 0.0

    assert not issubclass(Hold, GoalTask)
    with pytest.raises(AssertionError, match="has compute_reward"):
        episodes.goals(Subject(of(Hold, Claims), steps=STEPS))


def test_an_environments_own_error_is_told_once_and_is_the_cause():
    def fails(_):
        raise ZeroDivisionError("here")

    with pytest.raises(AssertionError) as error:
        check_robot_env(of(lambda: Hold(observe=fails)), steps=STEPS)
    assert isinstance(error.value.__cause__, ZeroDivisionError)
    line = str(error.value).splitlines()[1]
    assert line == "- observations (over bullet): ZeroDivisionError: here"
    assert str(error.value).count("ZeroDivisionError: here") == 1


@pytest.mark.slow
def test_all_faults_are_told_together():
    make = of(lambda: broken.kept(broken.drawing(Reach())), broken.SmallPicture)
    with pytest.raises(AssertionError) as error:
        check_robot_env(make, steps=STEPS)
    text = str(error.value)
    assert text.startswith("the environment:\n- ")
    for part in ("observations are new (over bullet): ", "pictures (over bullet): ", "seeding ("):
        assert f"\n- {part}" in text
