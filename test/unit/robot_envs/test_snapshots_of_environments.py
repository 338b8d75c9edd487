"""Snapshots of environments beyond the conformance suite: refusals, users' objects, what stays."""

import copy
import pickle

import gymnasium
import pytest

import cartpole  # noqa: F401 - registers the environments
from cartpole.robot import ROBOT
from cartpole.tasks import BalanceTask
from robot_envs import RobotEnv, SimulatorError
from robot_envs.variation import Variation


class Remembering(BalanceTask):
    """Counts in places that a copy of the attributes alone would miss."""

    def __init__(self):
        super().__init__()
        self.seen, self.by_sign = [], {True: 0, False: 0}

    def reward(self, state, action):
        self.seen.append(state.time)
        self.by_sign[state.joints["cart_pole"].position > 0.0] += 1
        return float(len(self.seen) + self.by_sign[True])


class Planning(BalanceTask):
    """Knows its environment and keeps snapshots of it."""

    non_persistent = ("env", "kept")
    env = None

    def __init__(self):
        super().__init__()
        self.kept = []


class Curriculum:
    """Varies nothing, but counts its levels."""

    def __init__(self):
        self.level = 0

    def draw(self, rng):
        self.level += 1
        return Variation(), {"level": self.level}


class Reading(BalanceTask):
    """Holds something whose state can't be read."""

    def __init__(self):
        super().__init__()
        self.lines = (line for line in "abc")


def returns(env, steps=10):
    """Rewards and flags of back and forth, which balances for a while."""
    return [env.step(step % 2)[1:4] for step in range(steps)]


@pytest.fixture
def made():
    envs = []

    def make(task=BalanceTask, **options):
        envs.append(RobotEnv(ROBOT, task(), **options))
        return envs[-1]

    yield make
    for env in envs:
        env.close()


def test_what_a_task_remembers_comes_back(made):
    env = made(Remembering)
    env.reset(seed=1)
    returns(env, 7)
    snapshot = env.save_state()
    first = returns(env)
    env.restore_state(snapshot)
    assert len(env.task.seen) == 7 and returns(env) == first


def test_a_task_may_know_its_environment_and_keep_snapshots(made):
    env = made(Planning)
    env.task.env = env
    env.reset(seed=1)
    env.task.kept += [env.save_state(), env.save_state()]
    snapshot = env.save_state()
    first = returns(env)
    env.restore_state(snapshot)
    assert returns(env) == first


def test_a_randomisation_goes_on_from_where_it_was(made):
    env = made(randomisation=Curriculum())
    env.reset(seed=1)
    snapshot = env.save_state()
    levels = []
    for _ in range(2):
        env.restore_state(snapshot)
        levels.append(env.reset()[1]["variation"])
    assert levels == [{"level": 2}, {"level": 2}]


def test_actions_that_a_space_samples_do_not_come_again(made):
    env = made()
    env.reset(seed=1)
    snapshot = env.save_state()
    drawn = []
    for _ in range(5):
        env.restore_state(snapshot)
        drawn.append([int(env.action_space.sample()) for _ in range(40)])
    assert len({str(each) for each in drawn}) == 5


def test_the_episode_counts_on_and_ends_as_before(made):
    env = made(max_steps=10)
    env.reset(seed=1)
    returns(env, 8)
    snapshot = env.save_state()
    for _ in range(2):
        env.restore_state(snapshot)
        assert [truncated for _, _, truncated in returns(env, 2)] == [False, True]
        with pytest.raises(gymnasium.error.ResetNeeded):
            returns(env, 1)


def test_an_ended_episode_is_ended_again(made):
    env = made(max_steps=3)
    env.reset(seed=1)
    returns(env, 3)
    snapshot = env.save_state()
    env.reset(seed=2)
    env.restore_state(snapshot)
    with pytest.raises(gymnasium.error.ResetNeeded):
        returns(env, 1)


def test_varied_robots_are_varied_as_they_were():
    options = {"randomisation": {"mass": 0.3, "length": 0.2, "pole_friction": 0.01}}
    env = gymnasium.make("cartpole/Balance-v0", **options).unwrapped
    env.reset(seed=1)
    returns(env, 5)
    snapshot = env.save_state()
    first = returns(env)
    env.reset(seed=9)
    env.restore_state(snapshot)
    assert returns(env) == first
    env.close()


def test_environments_and_snapshots_are_neither_copied_nor_pickled(made):
    env = made()
    env.reset(seed=0)
    for each, words in (
        (env, "environment .* save_state"),
        (env.save_state(), "snapshot .* restore"),
    ):
        for use in (copy.copy, copy.deepcopy, pickle.dumps):
            with pytest.raises(TypeError, match=f"^an? {words}"):
                use(each)
    wrapped = gymnasium.make("cartpole/Balance-v0")
    with pytest.raises(TypeError, match="^an environment can't be copied or pickled"):
        copy.deepcopy(wrapped)
    wrapped.close()


def test_refusals_name_the_reason(made):
    env, other = made(), made()
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.save_state()
    env.reset(seed=1)
    other.reset(seed=1)
    with pytest.raises(ValueError, match="another environment"):
        other.restore_state(env.save_state())
    env.begin_step(env.action_space.sample())
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.save_state()
    snapshot = other.save_state()
    other.close()
    for call in (other.save_state, lambda: other.restore_state(snapshot)):
        with pytest.raises(gymnasium.error.ClosedEnvironmentError):
            call()
    unreadable = made(Reading)
    unreadable.reset(seed=1)
    with pytest.raises(SimulatorError, match="Reading.lines.*generator"):
        unreadable.save_state()


def test_a_task_with_an_environment_among_what_is_saved_is_refused():
    env = gymnasium.make("cartpole/Balance-v0", backend="bullet").unwrapped
    env.reset(seed=1)
    env.task.env = env
    with pytest.raises(SimulatorError, match=r"^BalanceTask.env: a snapshot can't save a .*Env;"):
        env.save_state()
    env.close()
