"""The six-joint arm: its tip reaches a point in space, by positions of its joints."""

import math
from functools import partial
from typing import Any

import gymnasium
import numpy as np

from robot_envs.files import own_file
from robot_envs.robot import Robot
from robot_envs.robots import spaces
from robot_envs.task import Task
from robot_envs.world_state import InitialState, LinkQuery, StateQuery, WorldState

JOINTS = ("waist", "shoulder", "elbow", "forearm_roll", "wrist_pitch", "hand_roll")
HOME = (0.0, 0.4, 0.6, 0.0, 0.6, 0.0)  # [rad]: the hand hangs in front of the arm
RANGES = (2.9, 1.8, 2.2, 2.9, 1.9, 2.9)  # [rad] of the joints, either way
STEP = 0.08  # [rad] that an action moves a joint by, at most
CENTRE, HALF = (0.45, 0.0, 0.40), (0.15, 0.30, 0.20)  # [m] of the box that targets are drawn in
CLOSE = 0.02  # [m]: the tip is there

ARM = Robot(
    urdf=partial(own_file, "cartpole", "urdf/six_joint_arm.urdf.xacro"),
    controllers=partial(own_file, "cartpole", "config/robots/six_joint_arm.yaml"),
    run=("joint_state_controller", "arm_controller"),
    commanded=("arm_controller",),
    name="six_joint_arm",
    control_period=0.04,
)


class Reach(Task):
    """The tip goes to a target in front of the arm and stays there.

    | | |
    |---|---|
    | actions | Box(-1, 1, (6,)): by how much each joint's set-point moves, in units of 0.08 rad; waist, shoulder, elbow, forearm_roll, wrist_pitch, hand_roll |
    | observations | Box(15): set-points of the joints [2 rad]; tip (x, y, z) [0.5 m]; target minus tip (x, y, z) [0.5 m]; the same three, ten times as large and no further than 1 |
    | reward | -d / 0.5 m + exp(-(d / 0.02 m)²) - 0.02 \\|action\\|² / 6, for the distance d of the tip when the step is over |
    | start | joints within 0.3 rad of the pose in which the hand hangs in front of the arm; the target anywhere in a box of 0.3 x 0.6 x 0.4 m before it |
    | end | truncated after 50 steps (2 s); nothing terminates it |
    | info | `distance` [m]; `is_success`: it is at most 2 cm |
    """

    max_steps = 50
    query = StateQuery(links=(LinkQuery("tip"),))

    def __init__(self) -> None:
        self.target = CENTRE

    def action_space(self) -> gymnasium.spaces.Box:
        """See the class."""
        return spaces.actions(6)

    def observation_space(self) -> gymnasium.spaces.Box:
        """See the class."""
        return spaces.numbers(15)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        """Draws a pose, and the target."""
        x, y, z = (
            float(middle + half * rng.uniform(-1.0, 1.0))
            for middle, half in zip(CENTRE, HALF, strict=True)
        )
        self.target = (x, y, z)
        off = rng.uniform(-0.3, 0.3, 6)
        return InitialState(
            joints={
                name: float(home + each)
                for name, home, each in zip(JOINTS, HOME, off, strict=True)
            }
        )

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, tuple[float, ...]]:
        """Moves the set-points on, within the joints' ranges."""
        moves = STEP * action
        wanted = np.clip(np.add(set_points(state), moves), np.negative(RANGES), RANGES)
        return {"arm_controller": tuple(wanted.tolist())}

    def observe(self, state: WorldState) -> np.ndarray:
        """See the class."""
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
        """See the class."""
        away = self._away(state)
        effort = float(np.square(action).mean())
        return -2.0 * away + math.exp(-((away / CLOSE) ** 2)) - 0.02 * effort

    def info(self, state: WorldState) -> dict[str, Any]:
        """See the class."""
        away = self._away(state)
        return {"distance": away, "is_success": away <= CLOSE}

    def _away(self, state: WorldState) -> float:
        return math.dist(state.links["tip"].pose.position, self.target)


def set_points(state: WorldState) -> tuple[float, ...]:
    """Where the joints are told to be [rad]."""
    return state.commands["arm_controller"]
