"""What a user can get wrong in a task, options, actions and names: one line says what it should be."""

import math

import gymnasium
import numpy as np
import pytest
from support.scenes.solo_arm import SOLO, Hold, Reach, episode, is_a_line
from support.scenes.two_arms import PLINTH

from robot_envs import InitialState, LinkQuery, Object, Pose, Robot, RobotEnv, StateQuery
from robot_envs.errors import RobotEnvError
from robot_envs.making import make_environment

NAN = math.nan


def fails(*_):
    raise ZeroDivisionError("the user's own")


TASKS = {
    "an observation that isn't finite": (Hold(observe=lambda state: np.array([0.0, NAN])),
        r"Hold.observe\(\) returned numbers that aren't finite: \[ 0. nan\]"),
    "an observation of another shape": (Hold(observe=lambda state: np.zeros(3)),
        r"Hold.observe\(\) returned the shape \(3,\); its observation_space has \(2,\)"),
    "a joint's wrong name": (Hold(observe=lambda state: state.joints["elbo"]),
        "the state has no joint 'elbo'; did you mean 'elbow'"),
    "a link that wasn't asked for": (Hold(observe=lambda state: state.links["tip"]),
        "no link 'tip'; there are: none; the task's query names those that a state has"),
    "a model that wasn't asked for": (
        Hold(observe=lambda state: state.models["arms"], query=StateQuery(models=("arm",))),
        "no model 'arms'; did you mean 'arm'",
    ),
    "a reward that isn't finite": (Hold(reward=lambda *_: NAN),
        r"Hold.reward\(\) returned nan; .* finite number"),
    "an end of nothing": (Hold(is_terminal=lambda _: None),
        r"Hold.is_terminal\(\) returned None; .* True or False"),
    "no info": (Hold(info=lambda _: None), r"Hold.info\(\) returned None; it must be a dict"),
    "no actions": (Hold(action_space=lambda: None),
        r"Hold.action_space\(\) returned None; .* gymnasium.Space"),
    "no commands": (Hold(apply=lambda *_: None), "commands are given by controller, {'pair': ...}, not None"),
    "a controller's wrong name": (Hold(apply=lambda *_: {"pear": (0, 0)}),
        "no controller 'pear' .* did you mean 'pair'"),
    "one number for a group": (Hold(apply=lambda *_: {"pair": 0.3}),
        "command of 'pair' must be 2 finite numbers, for elbow, shoulder, not 0.3"),
    "a command that isn't finite": (Hold(apply=lambda *_: {"pair": [1, NAN]}),
        r"2 finite numbers, .* not \[1, nan\]"),
    "no beginning": (Hold(initial_state=lambda rng: None),
        r"an episode begins with an InitialState\(...\), not None"),
    "a beginning at a wrong joint": (Hold(initial_state=lambda rng: InitialState({"elbo": 0.3})),
        "no joint 'elbo' to place; did you mean 'elbow'"),
    "a beginning that isn't finite": (Hold(initial_state=lambda rng: InitialState({"elbow": NAN})),
        "puts the joint 'elbow' is a finite position, or one and a velocity, not nan"),
    "a wrong model's beginning": (Hold(initial_state=lambda rng: InitialState(models={"arn": Pose()})),
        "no model 'arn'; did you mean 'arm'"),
    "a model's beginning nowhere": (Hold(initial_state=lambda rng: InitialState(models={"arm": (0, 0, 0)})),
        r"puts the model 'arm' is a Pose\(\(x, y, z\)\), not \(0, 0, 0\)"),
    "a question that is none": (Hold(query="tip"), r"Hold.query is a StateQuery\(...\), not 'tip'"),
    "a link that is none": (Hold(query=StateQuery(links=("tip",))),
        r'links lists LinkQuery\("NAME"\), not \'tip\''),
    "a link's wrong name": (Hold(query=StateQuery(links=(LinkQuery("tp"),))),
        "no link 'tp'; did you mean 'tip'"),
    "a name for models": (Hold(query=StateQuery(models="arm")),
        r"models lists names: \('arm',\), and not 'arm'"),
    "contacts of a wrong name": (Hold(query=StateQuery(contacts_of=("for",))), "did you mean 'fore'"),
    "an object of a broken file": (Hold(objects=(Object("box", "<sdf>"),)),
        r"the object 'box' \(given as text\): not well-formed XML"),
    "an object nowhere": (Hold(objects=(Object("box", PLINTH, (0, 0, 1)),)),
        r"the object 'box': its pose is a Pose"),
    "an object for objects": (Hold(objects=Object("box", PLINTH)),
        r"Hold.objects lists objects: \(Object\(...\),\)"),
    "an object of a robot's name": (Hold(objects=(Object("arm", PLINTH),)),
        "model must be unique in a world, but 'arm' is there twice"),
    "an object of the world's name": (Hold(objects=(Object("ground_plane", PLINTH),)),
        "the object 'ground_plane': the world has a model of that name"),
    "a goal that can't be reached": (Reach(goal=lambda *_: np.array([2.0, 0.0])),
        r"the goal \[2. 0.\] isn't one of Reach's goals: Box\(-1.0, 1.0, \(2,\), float32\)"),
    "goals of another kind": (Reach(goals=lambda: gymnasium.spaces.Discrete(3)),
        r"Reach.goals\(\) .* must be a .*Box"),
    "something achieved that isn't finite": (Reach(achieved=lambda _: np.full(2, NAN)),
        r"Reach.achieved\(\) returned array\(\[nan, nan\]\); it must be finite"),
    "steps of a fraction": (Hold(max_steps=1.5), "max_steps must be at least 1, and a whole number, not 1.5"),
    "the class": (Hold, r"a task is an object, Hold\(...\), and not the class"),
    "no task": (3, "a task is an object of a class of robot_envs.Task, not 3"),
}  # fmt: skip


@pytest.mark.parametrize("method", ["apply", "observe", "reward", "is_terminal", "info", "initial_state"])
def test_a_tasks_own_error_comes_through_as_it_is(method):
    with pytest.raises(ZeroDivisionError, match="the user's own"):
        episode(task=Hold(**{method: fails}))


def test_spaces_may_be_attributes_as_gymnasium_has_them():
    """They stand for the methods that return them."""

    class Attributes(Hold):
        action_space = Hold().action_space()
        observation_space = Hold().observation_space()

    for task in (Attributes(), Hold(action_space=Attributes.action_space)):
        env = RobotEnv(SOLO, task)
        assert env.action_space == Attributes.action_space
        assert env.observation_space == Attributes.observation_space
        env.close()
    with pytest.raises(RobotEnvError, match=r"Hold.action_space\(\) returned 2; it must be a gymn"):
        RobotEnv(SOLO, Hold(action_space=2))


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


CASES = OPTIONS | {case: ({"task": task}, text) for case, (task, text) in TASKS.items()}


@pytest.mark.parametrize("case", CASES)
def test_a_task_an_option_or_an_action_that_cannot_be(case):
    options, text = CASES[case]
    with pytest.raises((RobotEnvError, ValueError, KeyError), match=text) as error:
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
