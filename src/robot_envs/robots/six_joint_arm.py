"""The six-joint arm: its tip reaches a point in space, by positions of its joints."""

import math
from typing import Any

import gymnasium
import numpy as np

from robot_envs.robots import actions, numbers
from robot_envs.robots.own import own_robot
from robot_envs.task import Task
from robot_envs.world_state import InitialState, LinkQuery, StateQuery, WorldState

JOINTS = ("waist", "shoulder", "elbow", "forearm_roll", "wrist_pitch", "hand_roll")
HOME = (0.0, 0.4, 0.6, 0.0, 0.6, 0.0)  # [rad]: the hand hangs in front of the arm
RANGES = (2.9, 1.8, 2.2, 2.9, 1.9, 2.9)  # [rad] of the joints, either way
STEP = 0.08  # [rad] that an action moves a joint by, at most
CENTRE, HALF = (0.45, 0.0, 0.40), (0.15, 0.30, 0.20)  # [m] of the box that targets are drawn in
CLOSE = 0.02  # [m]: the tip is there

ROBOT = own_robot("six_joint_arm", "arm_controller", control_period=0.04)


class ReachInSpace(Task):
    """The tip goes to a target in front of the arm and stays there.

    ## Action space
    `Box(-1, 1, (6,))`: by how much the set-points of waist, shoulder, elbow, forearm_roll, wrist_pitch and
    hand_roll move [0.08 rad].

    ## Observation space
    `Box((15,))`

    | numbers | what they are | unit |
    |---|---|---|
    | 0 to 5 | the joints' set-points | 2 rad |
    | 6 to 8 | position of the tip, (x, y, z) | 0.5 m |
    | 9 to 11 | from the tip to the target, (x, y, z) | 0.5 m |
    | 12 to 14 | the same, clipped at 1 | 0.05 m |

    ## Rewards
    -2 d + exp(-(d / 0.02)²) - 0.02 |action|² / 6, where d is the distance of the tip from the target after
    the step [m]: at most 1, for resting at the target.

    ## Start of an episode
    The hand hangs in front of the arm, each joint within 0.3 rad of it, at rest. The target is anywhere in a
    box of 0.3 x 0.6 x 0.4 m whose middle is 0.45 m ahead of the waist and 0.4 m above the ground.

    ## End of an episode
    Truncated after 50 steps of 0.04 s; never terminated.

    ## Info
    `distance`: d [m]. `is_success`: whether it is at most 0.02 m.
    """

    max_steps = 50
    action_names = JOINTS
    query = StateQuery(links=(LinkQuery("tip"),))

    def __init__(self) -> None:
        self.target = CENTRE

    def action_space(self) -> gymnasium.spaces.Box:
        return actions(6)

    def observation_space(self) -> gymnasium.spaces.Box:
        return numbers(15)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        """Draws a pose, and the target."""
        x, y, z = (
            float(middle + half * rng.uniform(-1.0, 1.0)) for middle, half in zip(CENTRE, HALF, strict=True)
        )
        self.target = (x, y, z)
        pose = np.add(HOME, rng.uniform(-0.3, 0.3, 6)).tolist()
        return InitialState(joints=dict(zip(JOINTS, pose, strict=True)))

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, tuple[float, ...]]:
        """Moves the set-points, within the joints' ranges."""
        moves = STEP * action
        wanted = np.clip(np.add(set_points(state), moves), np.negative(RANGES), RANGES)
        return {"arm_controller": tuple(wanted.tolist())}

    def observe(self, state: WorldState) -> np.ndarray:
        tip = state.links["tip"].pose.position
        way = [(there - here) / 0.5 for here, there in zip(tip, self.target, strict=True)]
        seen = [
            *(each / 2.0 for each in set_points(state)),
            *(each / 0.5 for each in tip),
            *way,
            *(max(-1.0, min(1.0, 10.0 * each)) for each in way),
        ]
        return np.array(seen, np.float32)

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        away = self._away(state)
        effort = float(np.square(action).mean())
        return -2.0 * away + math.exp(-((away / CLOSE) ** 2)) - 0.02 * effort

    def info(self, state: WorldState) -> dict[str, Any]:
        away = self._away(state)
        return {"distance": away, "is_success": away <= CLOSE}

    def _away(self, state: WorldState) -> float:
        return math.dist(state.links["tip"].pose.position, self.target)


def set_points(state: WorldState) -> tuple[float, ...]:
    """Returns the set-points of the joints [rad]."""
    return state.commands["arm_controller"]
