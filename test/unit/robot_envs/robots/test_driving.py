"""Driving to a goal: where starts and goals are, what is seen, and how an episode ends."""

import dataclasses
import math
from typing import Any

import gymnasium
import numpy as np
import pytest

import robot_envs.robots  # noqa: F401 - registers the environments
from robot_envs import EMPTY, InitialState, Pose, RobotEnv
from robot_envs.backends.world_files import world_models
from robot_envs.errors import RobotEnvError, TaskError
from robot_envs.robots.driving import DriveToGoal, Floor
from robot_envs.robots.rover import ROBOT, WORLDS, Navigate, NavigateImages, world_file

AT_ORIGIN = {"initial_state": InitialState(models={"rover": Pose()})}


def made(goal: tuple[float, float], world: Any = EMPTY, **options: Any) -> RobotEnv:
    """An environment that begins at the origin, in the direction of x."""
    env = RobotEnv(ROBOT, Navigate(world=world), **options)
    env.reset(seed=0, options=AT_ORIGIN)
    env.task.aim(goal)
    return env


@pytest.mark.parametrize("world", WORLDS)
def test_starts_and_goals_are_free_and_others_for_each_seed(world: str) -> None:
    env = gymnasium.make("robot_envs/Navigate-v0", world=world)
    goals = set()
    for seed in range(20):
        seen, info = env.reset(seed=seed)
        assert seen[:24].max() < 0.3 / 0.4 and 1.5 <= info["distance"] <= 4.0
        assert not info["touched"] and not info["is_success"]
        goals.add(env.unwrapped.task.goal)
    assert len(goals) == 20
    env.close()


def test_the_clearance_of_boxes_is_theirs_however_they_are_turned() -> None:
    text = (
        "<sdf version='1.6'><world name='w'><model name='m'><static>true</static>"
        "<pose>1 2 0 0 0 0</pose><link name='l'><collision name='c'><pose>1 0 0 0 0 {yaw}</pose>"
        "<geometry><box><size>2 1 1</size></box></geometry></collision></link></model></world></sdf>"
    )
    points = np.array([[2.0, 2.0], [4.0, 2.0], [2.0, 5.0], [4.0, 3.5]])
    plain = Floor(world_models(text.format(yaw=0.0)), 1.0).clearance(points)
    assert plain == pytest.approx([0.0, 1.0, 2.5, math.sqrt(2.0)])
    start = Floor(world_models(text.format(yaw=0.0)), 2.0).draw(np.random.default_rng(0), 0.5)
    assert 1.0 < math.dist(start, (2.0, 2.0)) < 3.0, "beside the box, in a world without walls"
    turned = Floor(world_models(text.format(yaw=0.5 * math.pi)), 1.0).clearance(points)
    assert turned == pytest.approx([0.0, 1.5, 2.0, math.hypot(1.5, 0.5)])


def test_nothing_begins_where_a_gate_swings() -> None:
    floor = Floor(world_models(world_file("gates")), 1.0)
    turn = np.linspace(0.0, 2.0 * math.pi, 50)
    reach = np.stack([-1.9 + 1.3 * np.cos(turn), 1.3 * np.sin(turn)], axis=1)
    assert floor.clearance(reach).max() == 0.0


def test_a_world_that_is_full_is_told() -> None:
    with pytest.raises(TaskError, match="no free point with a clearance of 9 m"):
        Navigate(clearance=9.0).initial_state(np.random.default_rng(0))


def test_straight_ahead_it_reaches_its_goal_and_is_rewarded_for_each_metre() -> None:
    env = made((2.0, 0.0))
    total, steps, ends = 0.0, 0, False
    while not ends:
        seen, reward, ends, _, info = env.step(np.array([1.0, 0.0], np.float32))
        total, steps = total + reward, steps + 1
        assert seen[-4:-2] == pytest.approx([1.0, 0.0], abs=0.01), "the bearing"
    assert info["is_success"] and info["distance"] == pytest.approx(0.25, abs=0.06)
    assert total == pytest.approx(2.0 * (2.0 - info["distance"]) - 0.02 * steps + 5.0, abs=0.01)
    assert seen[-2] == pytest.approx(1.0, abs=0.01), "as fast as it may"
    env.close()


def test_at_the_goal_it_stops_whatever_the_policy_wants() -> None:
    env = made((0.2, 0.0))
    commands = env.task.apply(np.array([1.0, 1.0], np.float32), env.state)
    assert commands == {"drive_controller": (0.0, 0.0, 0.0)}
    env.close()


def test_touching_ends_an_episode_and_costs_five() -> None:
    env = made((2.8, 0.0), world="room")  # behind a box
    ends, reward = False, 0.0
    while not ends:
        _, reward, ends, _, info = env.step(np.array([1.0, 0.0], np.float32))
    assert info["touched"] and not info["is_success"] and reward < -4.5
    assert 0.7 < env.state.models["rover"].pose.position[0] < 1.3
    env.close()


@pytest.mark.parametrize("side", [1, -1])
def test_the_camera_sees_what_stands_beside_the_rover(side: int) -> None:
    box = "<geometry><box><size>0.2 0.2 0.6</size></box></geometry>"
    text = (
        "<sdf version='1.6'><world name='w'><model name='m'><static>true</static>"
        f"<pose>0.1 {0.4 * side} 0.3 0 0 0</pose><link name='l'><collision name='c'>{box}</collision>"
        f"<visual name='v'>{box}</visual></link></model></world></sdf>"
    )
    pictures = []
    for world in (text, EMPTY):
        env: Any = RobotEnv(ROBOT, NavigateImages(world=world))
        pictures.append(env.reset(seed=0, options=AT_ORIGIN)[0]["depth"])
        env.close()
    seen = (pictures[0] > pictures[1] + 0.1)[:, ::side]  # that is nearer than the floor
    assert seen[:, :8].any() and not seen[:, 16:].any()


@pytest.mark.parametrize("step", [0.001, 0.005])
def test_a_circle_is_driven_as_commanded_however_long_the_steps(step: float) -> None:
    env = RobotEnv(dataclasses.replace(ROBOT, physics_step=step), Navigate(world=EMPTY))
    env.reset(seed=0, options=AT_ORIGIN)
    action = np.array([0.25, 0.5], np.float32)  # 0.5 m/s, 1 rad/s
    places = []
    for _ in range(36):
        env.step(action)
        places.append(env.state.models["rover"].pose.position[:2])
        env.task.aim((9.0, 9.0))
    middle = np.mean(places[4:35], axis=0)  # of about a turn
    radii = np.hypot(*(np.array(places[4:]) - middle).T)
    assert radii == pytest.approx(np.full(32, 0.5), abs=0.02)
    env.close()


def test_the_gates_swing_with_the_same_bits_in_each_episode() -> None:
    env = gymnasium.make("robot_envs/Navigate-v0", world="gates")
    runs = []
    for _ in range(2):
        env.reset(seed=4)
        turn = np.array([-1.0, 1.0], np.float32)  # on the spot
        runs.append([env.step(turn)[0] for _ in range(20)])
    assert np.array_equal(*runs)
    spread = np.ptp([env.step(turn)[0][:24].max() for _ in range(40)])
    assert spread > 0.01, "something comes nearer and goes away"
    env.close()


def test_sectors_keep_the_nearest_ray() -> None:
    task = Navigate(ranges=4)
    ranges = np.array([1.0, 2.0, math.inf, math.inf, -math.inf, 5.0, 3.0, 0.6], np.float32)
    assert task._sectors(ranges) == pytest.approx([0.3, 0.0, 3.0, 0.5])


def test_a_faulty_ray_counts_for_nothing_and_a_sector_without_others_is_an_error() -> None:
    task, nan = Navigate(ranges=2), math.nan
    assert task._sectors(np.array([nan, 2.0, 1.0, nan], np.float32)) == pytest.approx([0.15, 0.3])
    assert math.isnan(task._sectors(np.array([nan, nan, 1.0, 1.0], np.float32))[0])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"ranges": 0}, "ranges is a whole number from 1, not 0"),
        ({"ranges": 2.5}, "ranges is a whole number"),
        ({"touch": math.nan}, r"touch \(nan\)"),
        ({"nearest": 5.0}, "longer one than nearest"),
        ({"furthest": math.inf}, "furthest"),
    ],
)
def test_options_of_gymnasium_reach_the_base_class_and_are_checked(wrong, message) -> None:
    with pytest.raises(TaskError, match=message):
        gymnasium.make("robot_envs/Navigate-v0", **wrong).close()
    with pytest.raises(TaskError, match="helped is a share from 0 to 1, not 2"):
        gymnasium.make("robot_envs/PickCube-v0", helped=2.0)
    with pytest.raises(RobotEnvError, match="no option 'laser'"):
        gymnasium.make("robot_envs/Navigate-v0", laser="laser").close()


def test_a_vehicle_without_a_laser_sees_its_goal_alone() -> None:
    task = DriveToGoal(ROBOT, None, world=EMPTY)
    env = RobotEnv(ROBOT, task)
    assert env.observation_space.shape == env.reset(seed=0)[0].shape == (5,)
    assert abs(np.array(task.goal)).max() <= 4.0 and task.room(env.state) == math.inf
    env.close()


def test_a_wrong_goal_a_wrong_world_and_a_robot_without_cmd_vel_are_refused() -> None:
    for wrong in ((math.nan, 1.0), (1.0,), (1.0, 2.0, 3.0)):
        with pytest.raises(ValueError, match="a goal is"):
            Navigate().aim(wrong)
    with pytest.raises(RobotEnvError, match="no file"):
        gymnasium.make("robot_envs/Navigate-v0", world="cellar").close()
    from robot_envs.robots.furuta import ROBOT as FURUTA

    with pytest.raises(TaskError, match="needs one controller with cmd_vel"):
        _ = DriveToGoal(FURUTA, None).port


def pink(picture: np.ndarray) -> np.ndarray | None:
    """Where a picture shows the goal: the middle of its pixels, row and column."""
    red, green, blue = np.moveaxis(picture.astype(int), -1, 0)
    seen = np.argwhere((red > 2 * green) & (blue > 2 * green))
    return seen.mean(axis=0) if len(seen) > 10 else None


def test_pictures_show_the_goal_of_each_episode() -> None:
    """It was nowhere to be seen in a recording."""
    env: Any = gymnasium.make("robot_envs/Navigate-v0", render_mode="rgb_array").unwrapped
    try:
        for seed in range(6):
            env.reset(seed=seed)
            before = pink(env.render())
            assert before is not None, seed
            env.task.aim((env.task.goal[0] + 0.3, env.task.goal[1]))
            after = pink(env.render())
            assert after is not None and after[1] > before[1] + 3.0, "to the right"
    finally:
        env.close()
