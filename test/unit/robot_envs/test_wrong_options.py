"""What a user can get wrong in options, actions and names: one line says what to mend."""

import math

import numpy as np
import pytest
from support.scenes.solo_arm import Reach, episode, is_a_line

from robot_envs import InitialState, Robot, RobotEnvError
from robot_envs.making import make_environment

NAN = math.nan
OPTIONS = {
    "a backend that doesn't exist": ({"backend": "rose"}, "there is no backend 'rose'; did you mean 'ros'"),
    "a period that is no multiple": ({"control_period": 0.0085},
        "control period 0.0085 s is not a multiple of"),
    "a period that is no number": ({"control_period": "slow"},
        r"control_period is a number \[s\], not 'slow'"),
    "a render mode that doesn't exist": ({"render_mode": "rgb"},
        'render_mode is "human" or "rgb_array", not \'rgb\''),
    "pictures of no size": ({"width": 0}, "width and height lie in"),
    "an action out of its space": ({"action": np.array([0.0, 2.0])},
        r"an action is of Box\(-1.0, 1.0, \(2,\)"),
    "a reset's unknown option": ({"reset": {"initial_sate": InitialState()}},
        "reset knows no option 'initial_sate'; did you mean 'initial_state'"),
    "a reset's goal without goals": ({"reset": {"goal": [0.0]}}, "Hold has no goal; only a GoalTask does"),
    "a reset to nowhere": ({"reset": {"initial_state": {"elbow": 0.3}}},
        "initial_state is an InitialState, not"),
    "a reset to a goal that can't be reached": ({"task": Reach(), "reset": {"goal": [0.0, 3.0]}},
        r"the goal \[0.0, 3.0\] isn't one of Reach's goals"),
    "a class for a robot": ({"robot": Robot}, r"a robot is a Robot\(...\), not"),
}  # fmt: skip


@pytest.mark.parametrize("case", OPTIONS)
def test_an_option_or_action_that_cannot_be(case):
    options, text = OPTIONS[case]
    with pytest.raises((RobotEnvError, ValueError), match=text) as error:
        episode(**options)
    assert is_a_line(error.value)


@pytest.mark.parametrize(
    ("robot", "task", "text"),
    [
        ("support.scenes.solo_arm", "Hold", "solo_arm' must be written as module:attribute"),
        ("support.scenes.solo_am:SOLO", "Hold", "no module 'support.scenes.solo_am'"),
        ("support.scenes.solo_arm:SOLE", "Hold", "has no 'SOLE'; did you mean 'SOLO'"),
        ("support.scenes.solo_arm:arm", "Hold", "is <function arm at .*not a robot_envs.Robot"),
        ("support.scenes.solo_arm:SOLO", "Hol", "has no 'Hol'; did you mean 'Hold'"),
        ("support.scenes.solo_arm:SOLO", "SOLO", "which is not a subclass of robot_envs.Task"),
    ],
)
def test_names_of_what_an_id_is_made_of(robot, task, text):
    with pytest.raises(RobotEnvError, match=text) as error:
        make_environment(robot, f"support.scenes.solo_arm:{task}")
    assert is_a_line(error.value)


def test_nothing_but_tasks_and_robots_is_called(tmp_path):
    made = tmp_path / "made"
    solo = "support.scenes.solo_arm:SOLO"
    with pytest.raises(RobotEnvError, match="is not a subclass of robot_envs.Task"):
        make_environment(solo, "subprocess:Popen", args=["touch", str(made)])
    with pytest.raises(RobotEnvError, match="threading.Thread.* is not a robot_envs.Robot"):
        make_environment("threading:Thread", "support.scenes.solo_arm:Hold")
    assert not made.exists()
