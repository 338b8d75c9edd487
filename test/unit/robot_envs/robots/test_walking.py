"""The walking task: what it measures and rewards, in the trunk's own frame."""

import math
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

import robot_envs.robots  # noqa: F401 - registers the environments
from robot_envs import RobotEnv
from robot_envs.errors import TaskError
from robot_envs.robots.quadruped import HEIGHT, ROBOT, Walk
from robot_envs.world_state import Motion, Pose, Push, Twist
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.pose import from_rpy


def env_of(**options):
    return gymnasium.make("robot_envs/Quadruped-v0", **options).unwrapped


def state_with(env, pose, twist):
    return env.state._replace(models=type(env.state.models)({"quadruped": Motion(pose, twist)}))


@pytest.fixture(scope="module")
def env():
    made = env_of()
    made.reset(seed=0)
    yield made
    made.close()


@pytest.mark.parametrize("yaw", [0.0, 1.2, -2.8])
def test_the_velocity_is_that_of_the_trunks_own_heading(env, yaw):
    moving = Twist(
        (math.cos(yaw) - 0.5 * math.sin(yaw), math.sin(yaw) + 0.5 * math.cos(yaw), 0.0), (0, 0, 0.3)
    )
    state = state_with(env, Pose((3.0, 1.0, HEIGHT), from_rpy(0.0, 0.0, yaw)), moving)
    assert env.task.velocity(state) == pytest.approx((1.0, 0.5, 0.3))


def test_who_moves_as_commanded_gets_all_of_both_terms(env):
    env.task.aim((0.4, -0.1, 0.2))
    there = state_with(env, Pose((0, 0, HEIGHT)), Twist((0.4, -0.1, 0.0), (0.0, 0.0, 0.2)))
    terms = env.task.terms(there, env.task.velocity(there))
    assert terms["linear"] == pytest.approx(1.0) and terms["angular"] == pytest.approx(1.0)
    assert terms["height"] == terms["orientation"] == terms["fallen"] == 0.0
    stands = env.task.terms(there, (0.0, 0.0, 0.0))
    assert stands["linear"] == pytest.approx(math.exp(-0.17 / 0.03))


def test_commands_are_clipped_to_their_ranges(env):
    env.task.aim((9.0, -9.0, 9.0))
    assert tuple(env.task.command(env.state)) == (0.8, -0.6, 1.0)
    for wrong in ((1.0,), (math.nan, 0.0, 0.0)):
        with pytest.raises(ValueError, match="a command is"):
            env.task.aim(wrong)


@pytest.mark.parametrize(
    "pose, fell",
    [
        (Pose((0, 0, HEIGHT)), False),
        (Pose((0, 0, 0.49 * HEIGHT)), True),
        (Pose((0, 0, HEIGHT), from_rpy(0.9, 0.0, 2.0)), False),
        (Pose((0, 0, HEIGHT), from_rpy(1.1, 0.0, 2.0)), True),
        (Pose((0, 0, HEIGHT), from_rpy(0.0, -1.1, 0.0)), True),
    ],
)
def test_it_has_fallen_when_it_is_low_or_tilted_by_60_degrees(env, pose, fell):
    assert env.task.is_terminal(state_with(env, pose, Twist())) is fell


def test_it_stands_when_nothing_is_done_and_its_feet_touch(env):
    env.reset(seed=1)
    env.task.aim((0.0, 0.0, 0.0))
    for _ in range(100):
        seen, reward, terminated, *_, info = env.step(np.zeros(15, np.float32))
    assert not terminated and env.task.touching(env.state) == [True] * 4
    np.testing.assert_allclose(seen[:3], (0.0, 0.0, -1.0), atol=0.06)  # gravity
    assert not seen[-2:].any()  # no gait while it stands
    assert info["rewards"]["gait"] == 1.0 and reward > 0.04


def feet_at(task, phase, velocity):
    """Where the spheres at the ends of the shanks are, seen from the trunk."""
    at = task.middle + task.gait.offsets(phase, np.array(velocity))
    poses = link_poses(ROBOT.links, Pose(), dict(zip(task.joints, at.tolist(), strict=True)))
    return np.array([poses[foot].compose(Pose((0.0, 0.0, -0.2))).position for foot in task.feet])


@pytest.mark.parametrize("velocity", [(0.5, 0.0, 0.0), (0.0, -0.4, 0.0), (0.2, 0.1, 0.8)])
def test_the_gaits_feet_move_against_the_command_and_swing_back_lifted(velocity):
    task = Walk()
    before, middle, after = (feet_at(task, phase, velocity) for phase in (0.2, 0.25, 0.3))
    moved = (after - before) / (0.1 * task.gait.period)
    ahead, left, about = velocity
    for foot in (0, 3):  # lf, rh
        x, y, _ = before[foot]
        asked = (about * y - ahead, -about * x - left)
        np.testing.assert_allclose(moved[foot, :2], asked, rtol=0.2, atol=0.05)
    lifts = middle[:, 2] - feet_at(task, None, velocity)[:, 2]
    np.testing.assert_allclose(lifts, (0.0, 0.08, 0.08, 0.0), atol=0.015)
    assert task.gait.on_ground(0.25).tolist() == [True, False, False, True]


def test_without_lift_actions_are_relative_to_the_stance():
    assert not Walk(lift=0.0).gait.offsets(0.25, np.array((0.5, 0.0, 0.0))).any()


@pytest.mark.parametrize("asked", [(0.7, 0.0, 0.0), (0.0, 0.6, 0.0), (0.0, 0.0, 1.0)])
def test_the_gait_alone_moves_it_that_way(env, asked):
    env.reset(seed=3)
    env.task.aim(asked)
    moved = []
    for _ in range(200):
        *_, terminated, _, info = env.step(np.zeros(15, np.float32))
        assert not terminated
        moved.append(info["velocity"])
    mean = np.mean(moved[50:], axis=0)
    assert mean @ np.array(asked) > 0.5 * np.dot(asked, asked)


def test_an_episode_has_four_commands_of_which_some_ask_to_stand():
    made = env_of()
    drawn = []
    for seed in range(50):
        made.reset(seed=seed)
        drawn.append(made.task.commands.copy())
    drawn = np.array(drawn).reshape(-1, 3)
    assert 5 <= (drawn == 0.0).all(axis=1).sum() <= 40
    assert drawn[:, 0].min() < -0.2 and drawn[:, 0].max() > 0.5
    made.close()


def test_shoves_push_the_trunk_once_during_each_command():
    assert not Walk().initial_state(np.random.default_rng(0)).pushes
    pushes = Walk(shove=80.0).initial_state(np.random.default_rng(0)).pushes
    assert [int(each.start / 5.0) for each in pushes] == [0, 1, 2, 3]
    assert {each.link for each in pushes} == {"quadruped::base"}
    assert all(0.0 < math.hypot(*each.force) <= 80.0 for each in pushes)


def test_a_push_acts_for_its_time_and_in_its_own_episode_alone(env):
    pushes = [Push("quadruped::base", (0.0, 90.0, 0.0), 0.1, 0.1)]
    drawn = replace(env.task.initial_state(np.random.default_rng(0)), pushes=pushes)

    def speeds(initial, steps):
        env.reset(seed=0, options={"initial_state": initial})
        env.task.aim((0.0, 0.0, 0.0))
        given = []
        for _ in range(steps):
            env.step(np.zeros(15, np.float32))
            given.append(env.state.models["quadruped"].twist.linear[1])
        return given

    pushed, free = speeds(drawn, 10), speeds(replace(drawn, pushes=()), 10)
    assert pushed[:4] == free[:4] and pushed[9] > free[9] + 0.3
    speeds(drawn, 2)
    assert speeds(replace(drawn, pushes=()), 10) == free


@pytest.mark.parametrize("backend", ["bullet", pytest.param("ros-own", marks=pytest.mark.slow)])
def test_a_push_of_a_restored_moment_ends_with_its_episode(env, backend):
    drawn = replace(env.task.initial_state(np.random.default_rng(0)), pushes=[])
    pushed = replace(drawn, pushes=[Push("quadruped::base", (0.0, 90.0, 0.0), 0.1, 0.1)])
    env.reset(seed=0, options={"initial_state": pushed})
    moment = env.save_state()
    other = env_of(backend=backend)
    twists = []
    for restored in (False, True):
        other.reset(seed=0)
        if restored:
            other.restore_state(moment)
        other.reset(seed=0, options={"initial_state": drawn})
        for _ in range(10):
            other.step(np.zeros(15, np.float32))
        twists.append(other.state.models["quadruped"].twist)
    assert twists[0] == twists[1]
    other.close()


def test_other_weights_change_the_reward_and_unknown_terms_are_named():
    calm, plain = env_of(weights={"posture": 0.0}), env_of()
    action = np.full(15, 0.5, np.float32)
    for each in (calm, plain):
        each.reset(seed=0)
    difference = calm.step(action)[1] - plain.step(action)[1]
    assert difference == pytest.approx(0.1 * 0.25 * 0.02)
    with pytest.raises(TaskError, match="weights has speed; terms are linear"):
        Walk(weights={"speed": 1.0})


def test_without_an_imu_the_trunks_own_motion_says_the_same():
    tasks = Walk(lift=0.0), Walk(lift=0.0)  # it stands: steps shake the trunk
    blind = tasks[1]
    blind.imu, blind.query = None, tasks[0].reward_query
    envs = [RobotEnv(ROBOT, task) for task in tasks]
    for each in envs:
        each.reset(seed=4)
    for _ in range(20):
        one, other = (each.step(np.full(15, 0.2, np.float32))[0] for each in envs)
    np.testing.assert_allclose(one, other, atol=0.02)  # the IMU's are of up to 5 ms ago
    for each in envs:
        each.close()
