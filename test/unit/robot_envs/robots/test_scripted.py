"""That the tasks can be done: control by hand, from figures of the robots' files, does each of them."""

import math
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest

import robot_envs.robots  # noqa: F401 - registers the environments
from robot_envs.robots import gripper_arm, six_joint_arm
from robot_envs.world_state import WorldState

Policy = Callable[[WorldState], np.ndarray]


def play(env: gymnasium.Env, policy: Policy) -> tuple[float, int, list[dict[str, Any]], bool]:
    """Return, steps, infos and whether it terminated, of the episode that has begun."""
    total, infos, terminated, truncated = 0.0, [], False, False
    while not (terminated or truncated):
        action = np.clip(policy(env.unwrapped._state), -1.0, 1.0).astype(np.float32)
        _, reward, terminated, truncated, info = env.step(action)
        total += reward
        infos.append(info)
    return total, len(infos), infos, terminated


def succeed(
    identifier: str, policy: Callable[[Any, Any], Policy], seeds: int, least: float, **options: Any
) -> None:
    """Episodes of which each is done after 40 steps, and to its end.

    Args:
        policy: of an environment and the first observation.
        least: the least return.
    """
    env = gymnasium.make(f"robot_envs/{identifier}-v0", **options)
    for seed in range(seeds):
        seen, _ = env.reset(seed=seed)
        total, _, infos, _ = play(env, policy(env.unwrapped, seen))
        assert all(info["is_success"] for info in infos[40:])
        assert total > least
    env.close()


def state_of(state: WorldState, *names: str) -> np.ndarray:
    """Positions, then velocities."""
    joints = [state.joints[name] for name in names]
    return np.array([j.position for j in joints] + [j.velocity for j in joints])


class TestTwoLinkArm:
    LENGTHS = (0.30, 0.25)  # [m]

    def angles(self, x: float, y: float) -> np.ndarray:
        """Shoulder and elbow [rad] that put the tip there: the law of cosines."""
        upper, fore = self.LENGTHS
        elbow = math.acos((x * x + y * y - upper**2 - fore**2) / (2.0 * upper * fore))
        inner = math.atan2(fore * math.sin(elbow), upper + fore * math.cos(elbow))
        return np.array([math.atan2(y, x) - inner, elbow])

    def towards(self, x: float, y: float) -> Policy:
        wanted = self.angles(x, y)
        return lambda state: 3.0 * (wanted - state_of(state, "shoulder", "elbow")[:2])

    def test_every_target_is_reached_and_held(self) -> None:
        succeed("TwoLinkReach", lambda env, _: self.towards(*map(float, env.task.target)), 20, 0.0)

    def test_every_goal_is_reached_and_held(self) -> None:
        towards = lambda env, _: self.towards(*map(float, 0.1 * env.task.desired))  # noqa: E731
        succeed("TwoLinkReachGoal", towards, 20, -40.0)


class TestSixJointArm:
    OFFSETS = ((0.0, 0.0, 0.10), (0.0, 0.0, 0.20), (0.0, 0.0, 0.30), (0.20, 0.0, 0.0),
               (0.12, 0.0, 0.0), (0.08, 0.0, 0.0))  # fmt: skip # [m] from joint to joint
    TIP = (0.05, 0.0, 0.0)
    AXES = "zyyxyx"

    def tip(self, angles: np.ndarray) -> np.ndarray:
        """Where the tip is [m], from the joints' places and axes."""
        place, turned = np.zeros(3), np.eye(3)
        for offset, axis, angle in zip(self.OFFSETS, self.AXES, angles, strict=True):
            place = place + turned @ np.array(offset)
            turned = turned @ rotation(axis, angle)
        return place + turned @ np.array(self.TIP)

    def policy(self, target: tuple[float, float, float]) -> Policy:
        """Damped least squares on the set-points."""

        def act(state: WorldState) -> np.ndarray:
            angles = np.array(six_joint_arm.set_points(state))
            here, step = self.tip(angles), 1e-5
            slopes = np.array([(self.tip(angles + step * e) - here) / step for e in np.eye(6)]).T
            way = np.subtract(target, here)
            moves = slopes.T @ np.linalg.solve(slopes @ slopes.T + 1e-3 * np.eye(3), way)
            return moves / max(six_joint_arm.STEP, float(np.abs(moves).max()))

        return act

    @pytest.mark.slow
    def test_every_target_is_reached_and_held(self) -> None:
        succeed("SixJointReach", lambda env, _: self.policy(env.task.target), 6, 0.0)


def rotation(axis: str, angle: float) -> np.ndarray:
    """About an axis of the frame."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array(
        {
            "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
            "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
        }[axis]
    )


class TestGripperArm:
    ABOVE = 0.06  # [m] from where the gripper goes straight down
    CARRIED = 0.15  # [m]

    def policy(self, goal: np.ndarray | None = None) -> Policy:
        """Goes above the cube, down to it, closes, and takes it up or to a goal [m]."""
        closed = 0  # steps

        def act(state: WorldState) -> np.ndarray:
            nonlocal closed
            tip, cube = gripper_arm.places(state)
            way = cube - tip
            closed += closed > 0 or bool(np.linalg.norm(way) < 0.01)
            if closed > 4:
                way = (0.0, 0.0, self.CARRIED - cube[2]) if goal is None else goal - cube
            elif np.linalg.norm(way[:2]) > 0.01:
                way[2] += self.ABOVE
            moves = np.divide(way, gripper_arm.STEP)
            return np.append(moves / max(1.0, np.abs(moves).max()), 1.0 if closed else -1.0)

        return act

    @pytest.mark.parametrize(
        "backend", ["bullet", pytest.param("mujoco", marks=pytest.mark.extras("mujoco"))]
    )
    def test_every_cube_is_picked_and_held_up(self, backend: str) -> None:
        succeed("PickCube", lambda *_: self.policy(), 6, 70.0, backend=backend)

    def test_a_cube_is_taken_to_its_goal(self) -> None:
        def policy(_: Any, seen: dict[str, np.ndarray]) -> Policy:
            return self.policy(gripper_arm.UNIT * seen["desired_goal"][:3] + gripper_arm.MIDDLE)

        succeed("PickCubeGoal", policy, 5, -math.inf)

    def test_a_goal_is_reached_by_the_hand_that_holds_the_cube(self) -> None:
        task = gripper_arm.PickCubeGoal()
        goal, near, off = np.zeros(6), [0.3, 0.0, 0.0], [0.6, 0.0, 0.0]  # [0.1 m]
        achieved = np.array([near + near, near + off, off + near])
        assert task.is_success(achieved, goal).tolist() == [True, False, False]
        assert task.is_success(achieved[0], goal)

    def test_an_episode_may_begin_with_the_cube_in_the_hand(self) -> None:
        env: Any = gymnasium.make("robot_envs/PickCubeGoal-v0", helped=1.0).unwrapped
        held = 0
        for seed in range(10):
            env.reset(seed=seed)
            in_hand = env.state.commands["gripper_controller"][0] == gripper_arm.SHUT
            for _ in range(20):
                env.step(np.zeros(4, np.float32))
            tip, cube = gripper_arm.places(env.state)
            assert cube == pytest.approx(tip if in_hand else [*tip[:2], 0.02], abs=0.003)
            held += in_hand
        assert 0 < held < 10
        env.close()

    def test_by_camera_the_cube_is_in_the_picture_alone(self) -> None:
        made = gymnasium.make("robot_envs/PickCube-v0", render_mode="rgb_array", width=36, height=36)
        env, seen = gripper_arm.by_camera(made), []
        for y in (-0.1, 0.1):
            start = gripper_arm.placed(gripper_arm.MIDDLE, np.array([0.36, y, 0.02]), 0.0)
            seen.append(env.reset(seed=0, options={"initial_state": start})[0])
        first, other = seen
        assert env.observation_space.contains(first) and np.array_equal(first["state"], other["state"])
        assert not np.array_equal(first["pixels"], other["pixels"])
        env.close()


class TestFuruta:
    BALANCE = np.array([-0.27, 4.39, -0.25, 0.49])  # LQR at the top
    INERTIA, WEIGHT = 0.00208, 0.1 * 9.81 * 0.125  # [kg m²], [N m] of the rod

    def act(self, state: WorldState) -> np.ndarray:
        """Energy into the rod until it is near the top, then held there."""
        arm, rod, arm_speed, rod_speed = state_of(state, "arm_joint", "rod_joint")
        lean = math.remainder(rod, 2.0 * math.pi)
        missing = self.WEIGHT * (1.0 - math.cos(lean)) - 0.5 * self.INERTIA * rod_speed**2  # [J]
        if abs(lean) < 0.4 and abs(missing) < 0.05:
            return np.array([-self.BALANCE @ (arm, lean, arm_speed, rod_speed)])
        pumped = 15.0 * missing * rod_speed * math.cos(lean)
        return np.array([pumped - 0.5 * arm - 0.05 * arm_speed])

    def test_it_swings_up_and_stays_up(self) -> None:
        env = gymnasium.make("robot_envs/Furuta-v0")
        for seed in range(3):
            env.reset(seed=seed)
            total, steps, infos, _ = play(env, self.act)
            assert steps == 300
            assert all(info["upright"] for info in infos[250:])
            assert 100.0 < total < 300.0
        env.close()

    def test_an_arm_that_goes_round_ends_the_episode(self) -> None:
        env = gymnasium.make("robot_envs/Furuta-v0")
        env.reset(seed=0)
        _, steps, _, terminated = play(env, lambda state: np.ones(1))
        assert terminated
        assert steps < 200
        assert abs(env.unwrapped._state.joints["arm_joint"].position) > 2.0 * math.pi


class TestDoublePendulum:
    BALANCE = np.array([0.52, 3.88, 11.46, 0.70, 1.55, 1.40])  # LQR

    def act(self, state: WorldState) -> np.ndarray:
        seen = state_of(state, "cart_joint", "lower_joint", "upper_joint")
        return np.array([-self.BALANCE @ seen])

    def test_it_stays_up(self) -> None:
        env = gymnasium.make("robot_envs/DoublePendulum-v0")
        for seed in range(3):
            env.reset(seed=seed)
            total, steps, _, terminated = play(env, self.act)
            assert (steps, terminated) == (500, False)
            assert total > 495.0
        env.close()


class TestHopper:
    def test_it_stands_in_its_stance_on_its_foot(self) -> None:
        env = gymnasium.make("robot_envs/Hopper-v0")
        env.reset(seed=0)
        assert env.unwrapped._state.contacts == []
        _, steps, infos, terminated = play(env, lambda state: np.zeros(3))
        assert (steps, terminated) == (250, False)
        assert abs(infos[-1]["x"]) < 0.1
        touching = [f"{each.first} {each.second}" for each in env.unwrapped._state.contacts]
        assert any("foot" in pair and "ground" in pair for pair in touching)

    def test_a_knee_that_gives_way_makes_it_fall(self) -> None:
        env = gymnasium.make("robot_envs/Hopper-v0")
        env.reset(seed=0)
        _, steps, _, terminated = play(env, lambda state: np.array([1.0, 0.0, -1.0]))
        assert terminated
        assert steps < 250
