"""Small, quick, deterministic environments in NumPy, with goals or continuous actions."""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

NEAR = 0.1  # [m] of the goal


class Reach(gymnasium.Env[dict[str, np.ndarray], Any]):
    """A point that is moved to a goal. An episode lasts 20 steps.

    Args:
        joints: numbers of place, goal and action.
        moves: of a choice of single actions, up and down along each axis; 0: the actions are velocities.
        dense: rewards are distances; else -1 until it is near.
        says: whether the info says if it succeeded.
        fails_at: the step that raises an error; 0: none.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}

    def __init__(
        self,
        joints: int = 2,
        moves: int = 0,
        dense: bool = False,
        says: bool = True,
        fails_at: int = 0,
        render_mode: str | None = None,
    ) -> None:
        self.render_mode = render_mode
        place = spaces.Box(-2.0, 2.0, (joints,), np.float64)
        self.observation_space = spaces.Dict(
            {"observation": place, "achieved_goal": place, "desired_goal": place}
        )
        self.action_space: spaces.Space[Any] = (
            spaces.Discrete(moves) if moves else spaces.Box(-1.0, 1.0, (joints,), np.float32)
        )
        self._steps = np.concatenate([np.eye(joints), -np.eye(joints)])
        self._dense, self._says, self._fails_at = dense, says, fails_at

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        super().reset(seed=seed)
        size = self._steps.shape[1]
        self._place, self._goal = self.np_random.uniform(-0.6, 0.6, (2, size))
        self._taken = 0
        return self._observation(), {}

    def step(self, action: Any) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        self._taken += 1
        if self._taken == self._fails_at:
            raise RuntimeError("a joint is stuck")
        if isinstance(self.action_space, spaces.Discrete):
            velocity = self._steps[action]
        else:
            assert self.action_space.contains(action), f"{action} is beyond {self.action_space}"
            velocity = np.asarray(action, np.float64)
        self._place = np.clip(self._place + 0.2 * velocity, -2.0, 2.0)
        reward = float(self.compute_reward(self._place, self._goal, {}))
        near = bool(np.linalg.norm(self._place - self._goal) < NEAR)
        info = {"is_success": near} if self._says else {}
        return self._observation(), reward, False, self._taken >= 20, info

    def compute_reward(
        self, achieved: np.ndarray, desired: np.ndarray, info: Mapping[str, Any] | list[Any]
    ) -> np.ndarray:
        distance = np.linalg.norm(np.asarray(achieved) - desired, axis=-1)
        return -distance if self._dense else -(distance >= NEAR).astype(np.float64)

    def _observation(self) -> dict[str, np.ndarray]:
        place = self._place.copy()
        return {"observation": place, "achieved_goal": place, "desired_goal": self._goal.copy()}

    def render(self) -> np.ndarray:
        picture = np.full((64, 64, 3), 255, np.uint8)
        for point, colour in ((self._goal, (200, 40, 40)), (self._place, (40, 40, 40))):
            row, column = (16 * (point[:2] + 2.0)).astype(int).clip(0, 63)
            picture[row, column] = colour
        return picture


class SharedReach(Reach):
    """As over ROS: another one of its kind moves the same robot."""

    shares_robot = True
    robot: "SharedReach | None" = None  # who has moved it last

    def reset(self, **kwargs: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        SharedReach.robot = self
        return super().reset(**kwargs)

    def step(self, action: Any) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        assert SharedReach.robot is self, "somebody else has moved the robot"
        return super().step(action)


REACH, SHARED_REACH = "fakes/Reach-v0", "fakes/SharedReach-v0"
gymnasium.register(REACH, Reach, reward_threshold=-5.0)
gymnasium.register(SHARED_REACH, SharedReach, reward_threshold=-5.0)
