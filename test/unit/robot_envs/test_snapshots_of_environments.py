"""Snapshots of environments beyond the conformance suite: refusals, users' objects, what stays."""

import copy
import pickle
from dataclasses import replace
from unittest.mock import Mock

import gymnasium
import numpy as np
import pytest

import cartpole  # noqa: F401 - registers the environments
import robot_envs.robots  # noqa: F401
from cartpole.robot import ROBOT
from cartpole.tasks import BalanceTask
from robot_envs import EnvSnapshot, InitialState, InitialStates, RobotEnv, SimulatorError, diff
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


@pytest.fixture
def begun(made):
    """Make an environment, begin an episode with the seed 1, and take some steps of it."""

    def begin(task=BalanceTask, steps=0, **options):
        env = made(task, **options)
        env.reset(seed=1)
        returns(env, steps)
        return env

    return begin


def test_what_a_task_remembers_comes_back(begun):
    env = begun(Remembering, steps=7)
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


def test_a_randomisation_goes_on_from_where_it_was(begun):
    env = begun(randomisation=Curriculum())
    snapshot = env.save_state()
    levels = []
    for _ in range(2):
        env.restore_state(snapshot)
        levels.append(env.reset()[1]["variation"])
    assert levels == [{"level": 2}, {"level": 2}]


def test_actions_that_a_space_samples_do_not_come_again(begun):
    env = begun()
    snapshot = env.save_state()
    drawn = []
    for _ in range(5):
        env.restore_state(snapshot)
        drawn.append([int(env.action_space.sample()) for _ in range(40)])
    assert len({str(each) for each in drawn}) == 5


def test_the_episode_counts_on_and_ends_as_before(begun):
    env = begun(steps=8, max_steps=10)
    snapshot = env.save_state()
    for _ in range(2):
        env.restore_state(snapshot)
        assert [truncated for _, _, truncated in returns(env, 2)] == [False, True]
        with pytest.raises(gymnasium.error.ResetNeeded):
            returns(env, 1)
    ended = env.save_state()
    env.reset(seed=2)
    env.restore_state(ended)
    with pytest.raises(gymnasium.error.ResetNeeded):
        returns(env, 1)


def test_environments_are_neither_copied_nor_pickled(made):
    env = made()
    env.reset(seed=0)
    for use in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="^an environment can't be .* save_state"):
            use(env)
    wrapped = gymnasium.make("cartpole/Balance-v0")
    with pytest.raises(TypeError, match="^an environment can't be copied or pickled"):
        copy.deepcopy(wrapped)
    wrapped.close()


def test_refusals_name_the_reason(made):
    env, other = made(), made(sensor_noise=0.1)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.save_state()
    env.reset(seed=1)
    other.reset(seed=1)
    snapshot = env.save_state()
    with pytest.raises(ValueError, match=r"another environment: its imperfections .*\[\].*Sensor"):
        other.restore_state(snapshot)
    with pytest.raises(ValueError, match="another environment: its task"):
        made(Remembering).restore_state(snapshot)
    with pytest.raises(ValueError, match="it isn't a snapshot"):
        env.restore_state(snapshot.to_bytes())
    mujoco = made(backend="mujoco")
    with pytest.raises(SimulatorError, match="the engine .Bullet., and here is .Mujoco."):
        mujoco.restore_state(snapshot)
    arm = RobotEnv(replace(ROBOT, name="other"), BalanceTask())
    with pytest.raises(SimulatorError, match=r"models \['cartpole'\], and here are \['other'\]"):
        arm.restore_state(snapshot)
    arm.close()
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
    env.task.env = env
    env.reset(seed=1)
    with pytest.raises(SimulatorError, match=r"^BalanceTask.env: a snapshot can't save a .*Env;"):
        env.save_state()


@pytest.mark.parametrize(
    ("option", "one", "other"),
    [
        ("sensor_noise", 0.1, 0.2), ("sensor_delay", 3, 1), ("encoder_step", 0.01, 0.02),
        ("action_delay", 3, 1), ("actuator_limit", 1.0, 2.0), ("actuator_lag", 0.1, 0.2),
    ],
)  # fmt: skip
def test_imperfections_of_another_size_are_refused(begun, option, one, other):
    first, same, second = (begun(**{option: value}) for value in (one, one, other))
    same.restore_state(EnvSnapshot.from_bytes(first.save_state().to_bytes()))
    with pytest.raises(ValueError, match=f"another environment: its {option} is"):
        second.restore_state(first.save_state())


class Gone:  # what another environment's simulator has kept, which has ended
    def whole(self):
        raise SimulatorError("it was closed")


def test_a_refused_one_leaves_the_episode_as_it_is(begun):
    env, other = begun(), begun(backend="mujoco")
    for world, reason in ((other.save_state().world, "engine .Mujoco., and here"), (Gone(), "closed")):
        with pytest.raises(SimulatorError, match=reason):
            env.restore_state(replace(env.save_state(), world=world))
        env.step(1)


class Borrowing(BalanceTask):
    """Draws from the environment's generator in each step."""

    def __init__(self):
        super().__init__()
        self.rng = None

    def initial_state(self, rng):
        self.rng = rng
        return super().initial_state(rng)

    def reward(self, state, action):
        return self.rng.random()


def test_a_task_shares_the_environments_generator_again(made, begun):
    env, other = (make(Borrowing, sensor_noise=0.01) for make in (begun, made))
    returns(env, 3)
    snapshot = EnvSnapshot.from_bytes(env.save_state().to_bytes())
    other.restore_state(snapshot)  # before any reset
    assert returns(other) == returns(env) and other.task.rng is other.np_random
    other.reset(seed=3)
    other.restore_state(snapshot)
    env.restore_state(snapshot)
    assert returns(other) == returns(env)


def test_an_episode_begins_at_a_snapshot(begun):
    env = begun(steps=3, max_steps=5)
    snapshot, there = env.save_state(), env.state
    observation, info = env.reset(seed=7, options={"snapshot": snapshot})
    assert env.state.time == 0.0 and env.state.joints == there.joints
    np.testing.assert_array_equal(observation, env.task.observe(there))
    assert isinstance(info, dict) and len(returns(env, 5)) == 5  # it has all its steps
    assert env.state.time == pytest.approx(5 * env.control_period)
    for wrong in (None, snapshot.to_bytes()):
        with pytest.raises(ValueError, match="snapshot is what save_state"):
            env.reset(options={"snapshot": wrong})


@pytest.mark.parametrize("touches", [False, True])
def test_it_begins_with_the_commands_and_contacts_of_the_snapshot(touches):
    env = gymnasium.make("robot_envs/Hopper-v0").unwrapped
    held = {} if touches else dict.fromkeys(env.scene.ports, (0.1, 0.2, 0.3))
    env.reset(seed=1, options={"initial_state": InitialState(commands=held)})
    action = np.zeros(3)
    while touches and not env.state.contacts:
        assert not env.step(action)[2]
    snapshot, there = env.save_state(), env.state
    env.reset(seed=2, options={"snapshot": snapshot})
    assert env.state.contacts == there.contacts and env.state.commands == there.commands
    first = env.step(action)[1:4]
    env.restore_state(snapshot)
    assert env.step(action)[1:4] == first
    env.close()


class HardPlaces(BalanceTask):
    """Begins where it has been saved."""

    def __init__(self):
        super().__init__()
        self.places = None

    def initial_state(self, rng):
        return super().initial_state(rng) if self.places is None else self.places.draw(rng)


def test_a_tasks_episodes_begin_at_saved_states(made, tmp_path):
    env = made(HardPlaces)
    seen = []
    for number in range(3):
        env.reset(seed=number)
        returns(env, 3)
        seen.append(env.state.joints)
        env.save_state().save(tmp_path / f"{number}.snapshot")
    with pytest.raises(ValueError, match="no snapshot"):
        InitialStates(tmp_path / "nowhere")
    with pytest.raises(ValueError, match="a snapshot is what save_state"):
        InitialStates(["somewhere"])
    env.task.places = InitialStates(tmp_path)
    found = []
    for seed in range(20):
        env.reset(seed=seed)
        found.append(env.state.joints)
        assert env.reset(seed=seed)[0].tolist() == env.task.observe(env.state).tolist()
    assert all(each in found for each in seen) and all(each in seen for each in found)


def test_differences_are_named_with_their_values(begun):
    env = begun()
    one = env.save_state()
    assert diff(one, EnvSnapshot.from_bytes(one.to_bytes())) == []
    env.step(1)
    found = {each.place: each for each in diff(one, env.save_state())}
    assert found["now"].second - found["now"].first == 8_000_000
    assert str(found["environment/steps"]) == "environment/steps: 0 and 1"
    assert any(place.startswith("world/models/cartpole/motion/joints") for place in found)


def test_a_robot_that_was_varied_for_a_snapshots_episode_is_nominal_again(made):
    varied = gymnasium.make("cartpole/Balance-v0", randomisation={"mass": 0.3}).unwrapped
    varied.reset(seed=1)
    snapshot, env, same = varied.save_state(), made(), made()
    varied.close()
    same.reset(seed=2)
    there, first = same.save_state(), returns(same)
    for options in ({}, {"snapshot": there}):
        env.reset(options={"snapshot": snapshot})
        env.reset(seed=2, options=options)
        assert returns(env) == first
    env.reset(options={"snapshot": snapshot})
    env.restore_state(there)
    assert returns(env) == first


class Listing(BalanceTask):
    """Its state is a list."""

    count = 0

    def state_dict(self):
        return [self.count]

    def load_state_dict(self, state):
        (self.count,) = state


def test_a_tasks_state_may_be_any_plain_data(begun):
    env = begun(Listing)
    env.task.count, snapshot = 4, env.save_state()
    env.restore_state(snapshot)
    assert env.task.count == 0


def test_where_a_controller_cannot_load_its_state_all_else_is_restored(begun, monkeypatch):
    env = begun(Remembering, steps=7)
    snapshot, state = env.save_state(), env.state
    returns(env, 5)
    (controller,) = env.backend._sim.robots[0].manager.running
    monkeypatch.setattr(type(controller), "load_state_dict", lambda self, state: 1 / 0)
    with pytest.raises(SimulatorError, match="ZeroDivisionError"):
        env.restore_state(snapshot)
    assert len(env.task.seen) == 7 and env.state == state
    env.step(0)
    assert env.state.time == pytest.approx(state.time + env.control_period)


def test_ctrl_c_in_the_middle_leaves_nothing_but_a_reset(begun, monkeypatch):
    env = begun()
    monkeypatch.setattr("robot_envs.restoring.load", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        env.restore_state(env.save_state())
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(1)


def test_an_episode_beyond_its_last_step_is_truncated(made, begun):
    longer, shorter = begun(Remembering, steps=8), made(Remembering, max_steps=5)
    shorter.restore_state(longer.save_state())
    assert shorter.step(0)[3]


@pytest.mark.parametrize("identifier", ["robot_envs/NavigateImages-v0", "robot_envs/Navigate-v0"])
def test_an_episode_never_begins_with_the_readings_of_other_sensors(identifier: str) -> None:
    other = {"robot_envs/Navigate-v0", "robot_envs/NavigateImages-v0"} - {identifier}
    giver, taker = (gymnasium.make(name).unwrapped for name in (*other, identifier))
    giver.reset(seed=0)
    taker.reset(seed=0)
    before = taker.backend.poses(["base_footprint"])
    for snapshot in (giver.save_state(), EnvSnapshot.from_bytes(giver.save_state().to_bytes())):
        with pytest.raises(SimulatorError, match=r"reads the sensors .*'laser'"):
            taker.reset(seed=1, options={"snapshot": snapshot})
        assert taker.backend.poses(["base_footprint"]) == before
    giver.close()
    taker.close()
