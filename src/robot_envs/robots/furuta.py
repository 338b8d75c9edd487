"""The Furuta pendulum: its arm swings the rod up, and keeps it there."""

import math
from typing import Any

import gymnasium
import numpy as np

from robot_envs.robots import actions, numbers
from robot_envs.robots.own import own_robot
from robot_envs.task import Task
from robot_envs.world_state import InitialState, WorldState

STRONGEST = 0.3  # [N m] that an action asks for
TURNS = 2.0 * math.pi  # [rad] that the arm may be away from where it points at the start

ROBOT = own_robot("furuta", "arm_controller", control_period=0.02)


class SwingUp(Task):
    """Swing the hanging rod up and hold it upright, with the arm near where it began.

    ## Action space
    `Box(-1, 1, (1,))`: the motor's torque [0.3 N m].

    ## Observation space
    `Box((5,))`

    | numbers | what they are | unit |
    |---|---|---|
    | 0, 1 | cosine and sine of the rod's angle from upright | 1 |
    | 2 | the rod's speed | 10 rad/s |
    | 3 | the arm's angle | pi rad |
    | 4 | the arm's speed | 10 rad/s |

    ## Rewards
    (1 + cos rod) / 2 (0.4 + 0.3 calm + 0.3 near), between 0 and 1: calm = 1 / (1 + 0.01 (arm'² + rod'²)) for
    the speeds [rad/s], near = 1 / (1 + 0.3 arm²) for the arm's angle [rad].

    ## Start of an episode
    The rod hangs and the arm points ahead, at rest; angles and speeds are off by up to 0.1 rad and rad/s.

    ## End of an episode
    Terminated when the arm is a full turn away from ahead; truncated after 300 steps of 0.02 s.

    ## Info
    `upright`: whether the rod is within 0.2 rad of it.
    """

    max_steps = 300

    def __init__(self) -> None:
        self._last = 0.0

    def action_space(self) -> gymnasium.spaces.Box:
        return actions(1)

    def observation_space(self) -> gymnasium.spaces.Box:
        return numbers(5)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        arm, arm_speed, rod, rod_speed = (float(each) for each in rng.uniform(-0.1, 0.1, 4))
        return InitialState(joints={"arm_joint": (arm, arm_speed), "rod_joint": (math.pi + rod, rod_speed)})

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, float]:
        return {"arm_controller": STRONGEST * float(action[0])}

    def observe(self, state: WorldState) -> np.ndarray:
        arm, rod = state.joints["arm_joint"], state.joints["rod_joint"]
        seen = [
            math.cos(rod.position),
            math.sin(rod.position),
            rod.velocity / 10.0,
            arm.position / math.pi,
            arm.velocity / 10.0,
        ]
        return np.array(seen, np.float32)

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        arm, rod = state.joints["arm_joint"], state.joints["rod_joint"]
        height = (1.0 + math.cos(rod.position)) / 2.0
        calm = 1.0 / (1.0 + 0.01 * (arm.velocity**2 + rod.velocity**2))
        near = 1.0 / (1.0 + 0.3 * arm.position**2)
        return height * (0.4 + 0.3 * calm + 0.3 * near)

    def is_terminal(self, state: WorldState) -> bool:
        """Returns whether the arm has gone round."""
        return abs(state.joints["arm_joint"].position) > TURNS

    def info(self, state: WorldState) -> dict[str, Any]:
        return {"upright": math.cos(state.joints["rod_joint"].position) > math.cos(0.2)}
