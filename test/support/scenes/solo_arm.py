"""One arm with the simplest tasks, for tests that put one wrong piece in."""

from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from support.scenes.two_arms import LEFT, arm

from robot_envs import Commands, GoalTask, Robot, RobotEnv, Task, WorldState

SOLO: Robot = replace(LEFT, urdf=arm("", "Position", "Position"), namespace="", name="arm", world="empty")


class Hold(Task):
    """The arm goes where the action says."""

    max_steps = 5

    def __init__(self, **parts: Any) -> None:
        """`parts` are attributes and methods that are to be others."""
        vars(self).update(parts)

    def action_space(self) -> Box:
        return Box(-1.0, 1.0, (2,), np.float32)

    def observation_space(self) -> Box:
        return Box(-10.0, 10.0, (2,), np.float32)

    def apply(self, action: np.ndarray, state: WorldState) -> Commands:
        return {"pair": tuple(action.tolist())}

    def observe(self, state: WorldState) -> np.ndarray:
        return np.array([each.position for each in state.joints.values()])

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        return -abs(state.joints["elbow"].position)


class Reach(Hold, GoalTask):
    """The joints are to be somewhere."""

    def goals(self) -> Box:
        return Box(-1.0, 1.0, (2,), np.float32)

    def goal(self, rng: np.random.Generator, state: WorldState) -> np.ndarray:
        return rng.uniform(-1.0, 1.0, 2)

    def achieved(self, state: WorldState) -> np.ndarray:
        return self.observe(state)

    def is_success(self, achieved: np.ndarray, desired: np.ndarray) -> Any:
        return np.linalg.norm(achieved - desired, axis=-1) < 0.1

    reward = GoalTask.reward


NOTHING = np.zeros(2, np.float32)


def episode(
    robot: Any = SOLO,
    task: Any = None,
    action: Any = NOTHING,
    reset: dict[str, Any] | None = None,
    **options: Any,
) -> None:
    """Makes an environment, begins an episode and acts once."""
    env = RobotEnv(robot, Hold() if task is None else task, **options)
    try:
        env.reset(seed=0, options=reset)
        env.step(action)
    finally:
        env.close()


def is_a_line(error: BaseException) -> bool:
    """Whether an error's text is one line, which people read."""
    return "\n" not in str(error) and len(str(error)) < 400
