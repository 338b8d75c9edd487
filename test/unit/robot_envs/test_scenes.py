"""Worlds with several robots, objects, a file's obstacle, or a robot that drives; in this process."""

import math
from dataclasses import replace

import numpy as np
import pytest
from gymnasium.spaces import Box
from support.robots.fake_plant import FakePlant
from support.scenes.rover import ROVER, Push, Roll
from support.scenes.two_arms import LEFT, RIGHT, SKIN, Volley

from cartpole.robot import ROBOT
from cartpole.tasks import BalanceTask
from robot_envs import InitialState, LinkQuery, Motion, Pose, RobotEnv, RobotEnvError, StateQuery
from robot_envs.testing import differences, rollout


class Peeking(Roll):
    """What it observes isn't there where it is deployed."""

    def observe(self, state):
        return super().observe(state) * state.links["hull"].pose.position[2]


def test_a_coarser_physics_step(make) -> None:
    rover = replace(ROVER, physics_step=0.004)
    env, fine = RobotEnv(rover, Roll()), make("rover", Roll())
    counts = []
    for each in (env, fine):
        advance = each.backend._sim.advance
        each.backend._sim.advance = lambda n, go=advance: (counts.append(n), go(n))
        each.reset(seed=0)
        for _ in range(20):
            each.step(np.ones(2, np.float32))
    assert counts[-1] == 20 == 4 * counts[0]
    assert env.state.time == fine.state.time == pytest.approx(0.4)
    places = [each.state.models["rover"].pose.position for each in (env, fine)]
    assert places[0] == pytest.approx(places[1], abs=0.02) and places[0] != places[1]
    env.close()
    with pytest.raises(RobotEnvError, match="0.02 s is not a multiple of the physics step 0.003 s"):
        RobotEnv(replace(ROVER, physics_step=0.003), Roll(), "ros-own")
    with pytest.raises(RobotEnvError, match="physics_step must be a time between 1e-06 and 1"):
        RobotEnv(replace(ROVER, physics_step=0.0), Roll())


def test_what_a_reward_sees_the_policy_does_not(make) -> None:
    env = make("rover", Roll())
    env.reset(seed=0)
    for _ in range(20):
        _, reward, terminated, _, info = env.step(np.ones(2, np.float32))
    assert reward > 0.3 and not terminated and info["contacts"] >= 1
    with pytest.raises(KeyError, match="no link 'hull'; there are: none; the task's query names"):
        make("rover", Peeking()).reset(seed=0)


def test_a_backend_of_the_users_own_need_not_say_that_it_is_complete() -> None:
    class Plain:
        def __init__(self) -> None:
            self._plant = FakePlant()

        def __getattr__(self, name):
            if name == "complete":
                raise AttributeError(name)
            return getattr(self._plant, name)

    env = RobotEnv(ROBOT, BalanceTask(), Plain())
    env.reset(seed=0)
    assert env.step(1)[1] > 0.0


def test_a_world_of_joints_alone_rewards_nothing_and_says_so() -> None:
    plant = FakePlant()
    plant.complete = False
    task = BalanceTask()
    task.reward_query = StateQuery(links=(LinkQuery("pole"),))
    with pytest.warns(UserWarning, match="rewards of BalanceTask are 0, and nothing terminates"):
        env = RobotEnv(ROBOT, task, plant)
    env.reset(seed=0)
    assert env.step(1)[1:3] == (0.0, False)


BOX3 = Box(-np.inf, np.inf, (3,), np.float64)
HIT = np.array([0.3, 0.3, 0.6, 0.0])  # the right arm swings to the left, through where the ball lies


@pytest.fixture
def make(request, tmp_path):
    """Makes environments that are closed in the end."""

    def made(name="arms", task=None, **options):
        robots = {"arms": [LEFT, RIGHT], "rover": ROVER}[name]
        task = task or {"arms": lambda: Volley(tmp_path), "rover": Push}[name]()
        env = RobotEnv(robots, task, **options)
        request.addfinalizer(env.close)
        return env

    return made


class Seen:
    """A task whose states are looked at from outside."""

    def __init__(self, task):
        self.states, observe = [], task.observe

        def seen(state):
            self.states.append(state)
            return observe(state)

        task.observe = seen

    @property
    def last(self):
        return self.states[-1]


def test_joints_and_commands_are_told_apart_by_robot(make):
    env = make()
    seen = Seen(env.task)
    env.reset(seed=0)
    names = ["left::elbow", "left::shoulder", "right::elbow", "right::shoulder"]
    assert list(seen.last.joints) == names
    lift = seen.last.joints["right::shoulder"].position
    wanted = {"/left/pair": (0.0, 0.3), "/right/lift": lift, "/right/swing": 0.0}
    assert seen.last.commands == wanted
    for _ in range(4):  # as fast as the limit of its speed allows
        env.step(HIT)
    assert seen.last.commands["/left/pair"] == (0.3, 0.3)
    assert seen.last.joints["left::elbow"].position == pytest.approx(0.3, abs=1e-4)
    assert seen.last.joints["left::shoulder"].position == pytest.approx(0.3, abs=1e-4)


def test_an_arm_hits_the_ball_off_its_plinth_and_contacts_say_so(make):
    env = make()
    seen = Seen(env.task)
    env.reset(seed=0)
    told = [env.step(HIT)[4]["touched"] for _ in range(40)]
    assert ["plinth"] in told
    assert ["plinth", "right"] in told
    hit = seen.states[1 + told.index(["plinth", "right"])]
    contact = next(each for each in hit.contacts if each.second.startswith("right"))
    assert contact.first == SKIN
    assert contact.second.startswith("right::fore::")
    assert contact.total[0][0] < 0.0  # to the left
    assert hit.models["plinth"].pose.position == (0.0, 0.0, 0.125)


def test_limits_of_the_parameters_hold(make):
    env = make()
    seen = Seen(env.task)
    env.reset(seed=0)
    for _ in range(20):
        env.step(np.ones(4))
    efforts = [abs(state.joints["right::elbow"].effort) for state in seen.states]
    assert max(efforts) == 1.5


def test_an_arm_stops_at_the_files_wall(make, tmp_path):
    """The right arm, turned round by a quarter, swings towards it."""
    task = Volley(tmp_path)
    task.query = StateQuery(links=(LinkQuery("right::tip"),), contacts_of=("wall",))
    task.reward = lambda state, action: 0.0
    task.info = lambda state: {}
    task.observe = lambda state: np.array([*state.links["right::tip"].pose.position])
    task.observation_space = lambda: BOX3
    half = math.sqrt(0.5)
    turned = Motion(Pose((1.0, 0.0, 0.0), (0.0, 0.0, -half, half)))
    task.initial_state = lambda rng: InitialState(models={"right": turned})
    env = make(task=task)
    seen = Seen(task)
    start = env.reset(seed=0)[0]
    assert start == pytest.approx([1.0, 0.0, 0.23], abs=1e-6)
    ends = [env.step(np.array([0.0, 0.0, 0.4, 1.0]))[0] for _ in range(60)]
    assert 0.45 < max(y for _, y, _ in ends) < 0.55
    assert any(state.contacts for state in seen.states)
    assert {each.first for state in seen.states for each in state.contacts} == {"wall::link::stone"}


def test_what_nobody_drives_begins_each_episode_anew_as_well(make, tmp_path):
    task = Volley(tmp_path)
    tassel = LinkQuery("left::tassel", "left::fore")
    task.query = replace(task.query, links=(*task.query.links, tassel))
    env, seen = make(task=task), Seen(task)
    tassels = []
    for _ in range(2):
        env.reset(seed=3)
        tassels.append(seen.last.links["left::tassel"])
        for _ in range(25):
            env.step(env.action_space.sample())
    assert tassels[0] == tassels[1]
    turned = tassels[0].pose.orientation
    assert turned[0] == pytest.approx(math.sin(0.25), abs=1e-6)
    assert tassels[0].twist[1][0] == pytest.approx(1.0, abs=1e-6)
    swung = seen.last.links["left::tassel"].pose.orientation
    assert abs(swung[0] - turned[0]) > 0.05


def test_the_rover_rolls_to_the_crate_and_pushes_it(make):
    env = make("rover")
    seen = Seen(env.task)
    start = env.reset(seed=0)[0]
    assert seen.last.models["rover"].twist[0] == (0.5, 0.0, 0.0)
    ahead = seen.last.models["crate"].pose.position[:2] - np.array([0.4, 0.0])
    assert start[3:5] == pytest.approx(ahead)
    steps = [env.step(np.ones(2, np.float32)) for _ in range(50)]
    assert steps[-1][1] > 1.0  # [m]
    assert steps[-1][3]
    touched = {each.second for state in seen.states for each in state.contacts}
    assert any(each.startswith("crate::") for each in touched)
    again = env.reset(seed=0)[0]
    assert np.array_equal(start, again)


@pytest.mark.parametrize("name", ["arms", "rover"])
@pytest.mark.parametrize("engine", ["bullet", pytest.param("mujoco", marks=pytest.mark.extras("mujoco"))])
def test_the_same_seed_gives_the_same_bits_whatever_was_before(make, name, engine):
    first, again, other = (make(name, backend=engine) for _ in range(3))
    rollout(again, 30, seed=9)
    expected, found = rollout(first, 130, seed=5), rollout(again, 130, seed=5)
    assert not differences(expected, found)
    assert differences(expected, rollout(other, 130, seed=6))


def test_names_that_are_there_twice_are_told(tmp_path):
    third, ball, wall = (replace(LEFT, name=name) for name in ("third", "ball", "wall"))
    for robots, message in (
        ([LEFT, LEFT], "each model must be unique in a world, but 'left' is there twice"),
        ([LEFT, third], "namespace must be unique in a world, but 'left' is there twice"),
        ([ball, RIGHT], "model must be unique in a world, but 'ball' is there twice"),
        ([wall, RIGHT], "the world has a model 'wall'; give the robot another name"),
        ([], "needs a robot"),
    ):
        with pytest.raises(RobotEnvError, match=message):
            RobotEnv(robots, Volley(tmp_path))
