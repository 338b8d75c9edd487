"""The two-link arm: its tip reaches a point of the plane, with a dense reward or with a goal."""

import math
from functools import partial
from typing import Any

import gymnasium
import numpy as np

from robot_envs.files import own_file
from robot_envs.robot import Robot
from robot_envs.robots import spaces
from robot_envs.task import GoalTask, Task
from robot_envs.world_state import InitialState, LinkQuery, StateQuery, WorldState

UPPER_ARM, FOREARM = 0.30, 0.25  # [m]
NEAREST, FURTHEST = 0.20, 0.50  # [m] of targets from the shoulder
WIDEST = 0.5 * math.pi  # [rad] of targets from straight ahead, either way
CLOSE = 0.02  # [m]: the tip is there
FASTEST = 3.0  # [rad/s] that an action asks for

ARM = Robot(
    urdf=partial(own_file, "cartpole", "urdf/two_link_arm.urdf.xacro"),
    controllers=partial(own_file, "cartpole", "config/robots/two_link_arm.yaml"),
    run=("joint_state_controller", "shoulder_controller", "elbow_controller"),
    commanded=("shoulder_controller", "elbow_controller"),
    name="two_link_arm",
    control_period=0.04,
)


class Reach(Task):
    """The tip goes to a target as fast as it can and stays there.

    | | |
    |---|---|
    | actions | Box(-1, 1, (2,)): speed asked of shoulder and elbow, in units of 3 rad/s; a speed controller follows |
    | observations | Box(10): cos and sin of shoulder, cos and sin of elbow; their speeds [3 rad/s]; tip (x, y) [0.5 m]; target minus tip (x, y) [0.5 m] |
    | reward | -d / 0.5 m + exp(-(d / 0.02 m)²) - 0.02 \\|action\\|², for the distance d of the tip when the step is over |
    | start | joints anywhere within 0.8 of their ranges, at rest; the target anywhere in front: 0.2 to 0.5 m away from the shoulder, up to 2 rad to either side |
    | end | truncated after 50 steps (2 s); nothing terminates it |
    | info | `distance` [m]; `is_success`: it is at most 2 cm |
    """

    max_steps = 50
    query = StateQuery(links=(LinkQuery("tip"),))

    def __init__(self) -> None:
        self.target = (FURTHEST, 0.0)

    def action_space(self) -> gymnasium.spaces.Box:
        """See the class."""
        return spaces.actions(2)

    def observation_space(self) -> gymnasium.spaces.Box:
        """See the class."""
        return spaces.numbers(10)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        """Draws a pose, and the target."""
        self.target = draw_target(rng)
        return draw_pose(rng)

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, float]:
        """The speeds of both joints."""
        return speeds(action)

    def observe(self, state: WorldState) -> np.ndarray:
        """See the class."""
        x, y = tip(state)
        aim = self.target
        seen = [*joints(state), 2.0 * x, 2.0 * y, 2.0 * (aim[0] - x), 2.0 * (aim[1] - y)]
        return np.array(seen, np.float32)

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        """See the class."""
        away = self._away(state)
        effort = float(np.square(action).sum())
        return -2.0 * away + math.exp(-((away / CLOSE) ** 2)) - 0.02 * effort

    def info(self, state: WorldState) -> dict[str, Any]:
        """See the class."""
        away = self._away(state)
        return {"distance": away, "is_success": away <= CLOSE}

    def _away(self, state: WorldState) -> float:
        return math.dist(tip(state), self.target)


class ReachGoal(GoalTask):
    """The tip goes to a goal; the reward only says whether it is there. For hindsight experience replay.

    | | |
    |---|---|
    | actions | as in `Reach` |
    | observations | Dict: `observation` Box(6): cos and sin of shoulder, cos and sin of elbow, their speeds [3 rad/s]; `achieved_goal`, `desired_goal` Box(2): where the tip is and where it shall be, (x, y) [m] |
    | reward | 0 if the tip is within 2 cm of the goal when the step is over, else -1 |
    | start, end | as in `Reach` |
    | info | `is_success`: the tip is there |
    """

    max_steps = 50
    query = StateQuery(links=(LinkQuery("tip"),))

    def action_space(self) -> gymnasium.spaces.Box:
        """See the class."""
        return spaces.actions(2)

    def observation_space(self) -> gymnasium.spaces.Box:
        """See the class."""
        return spaces.numbers(6)

    def goals(self) -> gymnasium.spaces.Box:
        """Points of the plane (x, y) [m]."""
        return gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        """Draws a pose."""
        return draw_pose(rng)

    def goal(self, rng: np.random.Generator, state: WorldState) -> np.ndarray:
        """Draws a point that the tip can reach [m]."""
        return np.array(draw_target(rng), np.float32)

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, float]:
        """The speeds of both joints."""
        return speeds(action)

    def observe(self, state: WorldState) -> np.ndarray:
        """See the class."""
        return np.array(joints(state), np.float32)

    def achieved(self, state: WorldState) -> np.ndarray:
        """Where the tip is [m]."""
        return np.array(tip(state), np.float32)

    def is_success(self, achieved: np.ndarray, desired: np.ndarray) -> np.ndarray:
        """Whether the tip is there; vectorised."""
        return np.linalg.norm(achieved - desired, axis=-1) <= CLOSE


def draw_pose(rng: np.random.Generator) -> InitialState:
    """A pose within 0.8 of the joints' ranges, at rest."""
    shoulder, elbow = rng.uniform(-2.4, 1.6), rng.uniform(0.2, 2.4)
    return InitialState(joints={"shoulder": float(shoulder), "elbow": float(elbow)})


def draw_target(rng: np.random.Generator) -> tuple[float, float]:
    """A point (x, y) [m] that the tip can reach; each as likely as any other."""
    radius = math.sqrt(rng.uniform(NEAREST**2, FURTHEST**2))
    bearing = rng.uniform(-WIDEST, WIDEST)
    return radius * math.cos(bearing), radius * math.sin(bearing)


def speeds(action: np.ndarray) -> dict[str, float]:
    """What the controllers are told [rad/s]."""
    shoulder, elbow = action * FASTEST
    return {"shoulder_controller": float(shoulder), "elbow_controller": float(elbow)}


def joints(state: WorldState) -> list[float]:
    """Cosine and sine of shoulder and elbow, and their speeds [3 rad/s]."""
    shoulder, elbow = state.joints["shoulder"], state.joints["elbow"]
    return [
        math.cos(shoulder.position),
        math.sin(shoulder.position),
        math.cos(elbow.position),
        math.sin(elbow.position),
        shoulder.velocity / FASTEST,
        elbow.velocity / FASTEST,
    ]


def tip(state: WorldState) -> tuple[float, float]:
    """Where the tip is in the plane, (x, y) [m]."""
    x, y, _ = state.links["tip"].pose.position
    return x, y
