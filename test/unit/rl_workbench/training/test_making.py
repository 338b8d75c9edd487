"""Gymnasium's environments by id: what they become, and what is refused in one line."""

import math

import gymnasium
import numpy as np
import pytest
from support.training.learning_fakes import POLE, SPOILT, Died, Still, register_with

from rl_workbench import errors
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.environments import discrete_actions, make_environment, robot_options, shares_robot


@pytest.mark.parametrize("number", [math.nan, math.inf, -1e39])
@pytest.mark.parametrize("what", ["observation", "reward"])
def test_what_is_no_number_is_refused(what: str, number: float) -> None:
    env = make_environment(SPOILT, {what: number})
    env.reset(seed=0)
    for _ in range(29):
        env.step(0)
    words = f"the {what} of {SPOILT} isn't finite in float32: .*(nan|inf|-1.?e[+]39)"
    with pytest.raises(WorkbenchError, match=words):
        env.step(0)


def test_an_environment_that_fails_as_gymnasiums_do_is_one_line(monkeypatch) -> None:
    env = make_environment(POLE, {"dies_after": 1})
    env.reset(seed=0)
    env.step(0)
    with pytest.raises(WorkbenchError, match="^the connection broke; the simulator has ended$"):
        env.step(0)

    def dead(**arguments: object) -> None:
        raise Died("no simulator")

    monkeypatch.setattr(env.unwrapped, "reset", dead)
    with pytest.raises(WorkbenchError, match="^no simulator$"):
        env.reset()


def test_options_change_no_code_of_a_registration(monkeypatch) -> None:
    spec = gymnasium.registry[POLE]
    monkeypatch.setitem(spec.kwargs, "task", "my_robot.tasks:Reach")
    words = f"can't make {POLE}: its task is my_robot.tasks:Reach; no option changes it"
    with pytest.raises(WorkbenchError, match=words):
        make_environment(POLE, {"task": "os:getcwd"})


def test_a_wrapper_of_another_kind_is_not_called() -> None:
    with pytest.raises(WorkbenchError, match="--wrapper subprocess:Popen: it is no gymnasium.Wrap"):
        make_environment(POLE, wrapper="subprocess:Popen")


class Endless(Still):
    max_steps = None


class OldGym(Still):
    """As one wrote them for gym before 0.26."""

    def reset(self, seed=None, options=None):
        return np.zeros(2, np.float32)


class OldStep(Still):
    def step(self, action):
        return np.zeros(2, np.float32), 1.0, False, {}


class Unseeded(Still):
    def reset(self):
        return np.zeros(2, np.float32)


def length(env: gymnasium.Env, most: int = 20_000) -> int:
    """Of an episode [steps]."""
    env.reset(seed=0)
    return next((n for n in range(1, most) if any(env.step(0)[2:4])), most)


def test_an_episode_without_an_end_is_truncated_and_said_once(monkeypatch, capsys) -> None:
    env_id = register_with(monkeypatch, Endless)
    env = make_environment(env_id)
    assert length(env) == length(env) == 10_000
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "max_episode_steps=N" in said and env_id in said
    assert length(make_environment(env_id, {"max_episode_steps": 10_007})) == 10_007
    monkeypatch.setattr(Endless, "max_steps", 12_000)  # it says so itself
    assert length(make_environment(env_id)) == 20_000
    assert not capsys.readouterr().err


@pytest.mark.parametrize("kind", [OldGym, OldStep, Unseeded])
@pytest.mark.parametrize("limit", [{}, {"max_episode_steps": 9}])
def test_what_was_written_for_the_old_gym_is_named(monkeypatch, kind, limit: dict) -> None:
    env = make_environment(register_with(monkeypatch, kind), limit)
    with pytest.raises(WorkbenchError, match=r"written for the old gym: Gymnasium's reset\(seed"):
        length(env)


@pytest.mark.extras("Box2D")
@pytest.mark.parametrize(
    ("env_id", "options", "words"),
    [("LunarLander-v3", {"gravity": 5}, "must be between -12 and 0"),
     ("FrozenLake-v1", {"map_name": "none"}, "'none'"),
     ("CartPole-v1", {"wheels": 4}, "unexpected keyword")],
)  # fmt: skip
def test_options_that_an_environment_refuses(env_id: str, options: dict, words: str) -> None:
    with pytest.raises(WorkbenchError, match=f"can't make {env_id}: .*{words}") as raised:
        make_environment(env_id, options)
    assert "\n" not in str(raised.value)


def test_one_whose_package_is_missing(monkeypatch) -> None:
    def missing(*arguments: object, **options: object) -> None:
        raise gymnasium.error.DependencyNotInstalled("MuJoCo is not installed")

    monkeypatch.setattr(gymnasium, "make", missing)
    monkeypatch.setattr(errors.hints, "extras", "./ws extras")
    words = r"Ant-v5 needs more packages \(./ws extras may install them\): MuJoCo"
    with pytest.raises(WorkbenchError, match=words):
        make_environment("Ant-v5")


def test_other_observations_are_flattened() -> None:
    """FrozenLake observes one number of 16."""
    env = make_environment("FrozenLake-v1")
    assert isinstance(env.unwrapped.observation_space, gymnasium.spaces.Discrete)
    assert env.observation_space.shape == (16,)
    assert np.asarray(env.reset(seed=0)[0]).tolist() == [1] + [0] * 15


def test_what_cannot_be_flattened_is_refused(monkeypatch) -> None:
    lists = gymnasium.spaces.Sequence(gymnasium.spaces.Discrete(2))
    monkeypatch.setattr(gymnasium.registry[POLE].entry_point, "observation_space", lists)
    with pytest.raises(WorkbenchError, match=f"{POLE} observes Sequence.*only from vectors"):
        make_environment(POLE)


@pytest.mark.parametrize(
    ("space", "words"),
    [(gymnasium.spaces.Box(-1, 1, (1,)), r"has Box\(.*ppo, a2c, sac, td3 or ddpg: these fit it"),
     (gymnasium.spaces.MultiDiscrete([2, 2]), "has MultiDiscrete.*ppo or a2c: these fit it"),
     (gymnasium.spaces.Discrete(2, start=1), "ppo or a2c: these fit it")],
)  # fmt: skip
def test_actions_that_are_no_choice_of_single_ones(monkeypatch, space, words: str) -> None:
    env = make_environment(POLE)
    assert discrete_actions(env, POLE, "DQN") == 2
    monkeypatch.setattr(gymnasium.registry[POLE].entry_point, "action_space", space)
    with pytest.raises(WorkbenchError, match=rf"DQN needs .*Discrete\(n\); .*{words}"):
        discrete_actions(make_environment(POLE), POLE, "DQN")


def test_whether_there_is_one_robot() -> None:
    class Connected(gymnasium.Wrapper):
        shares_robot = True

    assert not shares_robot(make_environment(POLE))
    env = Connected(gymnasium.make(POLE))
    assert shares_robot(gymnasium.wrappers.TimeLimit(env, 5)), "however it is wrapped"


def test_which_options_name_a_robot_that_is_shared(monkeypatch) -> None:
    env, given = make_environment(POLE), {"backend": "ros", "noise": 0.1}
    assert robot_options(env, given) is None
    monkeypatch.setattr(env.unwrapped, "shares_robot", True, raising=False)
    assert robot_options(env, given) == {}, "any other one moves it"
    same = {"backend": ["ros", "ros-realtime"]}
    monkeypatch.setattr(env.unwrapped, "same_robot_options", same, raising=False)
    assert robot_options(env, given) == {"backend": ["ros", "ros", "ros-realtime"]}


def failing(env: gymnasium.Env) -> gymnasium.Env:
    raise ValueError("not this one")


def nothing(env: gymnasium.Env) -> None:
    """Returns no environment."""


@pytest.mark.parametrize("why", ["failing", "nothing", "image"])
def test_a_refused_environment_is_closed(monkeypatch, why: str) -> None:
    closed = []
    kind = gymnasium.registry[POLE].entry_point
    monkeypatch.setattr(kind, "close", lambda self: closed.append("once"))
    if why == "image":
        image = gymnasium.spaces.Box(0, 255, (64, 64, 3), np.uint8)
        monkeypatch.setattr(kind, "observation_space", image)
    with pytest.raises(WorkbenchError):
        make_environment(POLE, wrapper="" if why == "image" else f"{__name__}:{why}")
    assert closed == ["once"]
