"""The two-link arm: its tip reaches a point of the plane, with a dense reward or with a goal."""

import math
from typing import Any

import gymnasium
import numpy as np

from robot_envs.robots import actions, numbers
from robot_envs.robots.own import own_robot
from robot_envs.task import GoalTask, Task
from robot_envs.world_state import InitialState, LinkQuery, StateQuery, WorldState

NEAREST, FURTHEST = 0.20, 0.50  # [m] of targets from the shoulder
WIDEST = 0.5 * math.pi  # [rad] of targets from straight ahead, either way
CLOSE = 0.02  # [m]: the tip is there
NEAR = 0.05  # [m] of the way to the target, which is seen better from there on
GOAL_UNIT = 0.1  # [m]: numbers of order 1, which networks tell apart
FASTEST = 3.0  # [rad/s] that an action asks for

ROBOT = own_robot("two_link_arm", "shoulder_controller", "elbow_controller", control_period=0.04)


class Reach(Task):
    """The tip goes to a target as fast as it can and stays there.

    ## Action space
    `Box(-1, 1, (2,))`: the speed asked of shoulder and elbow [3 rad/s]. A speed controller follows it with a
    torque.

    ## Observation space
    `Box((12,))`

    | numbers | what they are | unit |
    |---|---|---|
    | 0 to 3 | cosine and sine of the shoulder's angle, of the elbow's | 1 |
    | 4, 5 | speed of shoulder and elbow | 3 rad/s |
    | 6, 7 | position of the tip from the shoulder, (x, y) | 0.5 m |
    | 8, 9 | from the tip to the target, (x, y) | 0.5 m |
    | 10, 11 | the same, clipped at 1 | 0.05 m |

    ## Rewards
    -2 d + exp(-(d / 0.02)²) - 0.02 |action|², where d is the distance of the tip from the target after the
    step [m]: at most 1, for resting at the target.

    ## Start of an episode
    Shoulder within -2.4 and 1.6 rad, elbow within 0.2 and 2.4 rad, at rest. The target is 0.2 to 0.5 m away
    from the shoulder, up to a right angle to either side; each point of that is as likely as any other.

    ## End of an episode
    Truncated after 50 steps of 0.04 s; never terminated.

    ## Info
    `distance`: d [m]. `is_success`: whether it is at most 0.02 m.
    """

    max_steps = 50
    query = StateQuery(links=(LinkQuery("tip"),))

    def __init__(self) -> None:
        self.target = (FURTHEST, 0.0)

    def action_space(self) -> gymnasium.spaces.Box:
        return actions(2)

    def observation_space(self) -> gymnasium.spaces.Box:
        return numbers(12)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        """Draws a pose, and the target."""
        self.target = draw_target(rng)
        return draw_pose(rng)

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, float]:
        return speeds(action)

    def observe(self, state: WorldState) -> np.ndarray:
        here = tip(state)
        way = [aim - at for aim, at in zip(self.target, here, strict=True)]
        near = [max(-1.0, min(1.0, each / NEAR)) for each in way]
        seen = [*joints(state), *(each / 0.5 for each in (*here, *way)), *near]
        return np.array(seen, np.float32)

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        away = self._away(state)
        effort = float(np.square(action).sum())
        return -2.0 * away + math.exp(-((away / CLOSE) ** 2)) - 0.02 * effort

    def info(self, state: WorldState) -> dict[str, Any]:
        away = self._away(state)
        return {"distance": away, "is_success": away <= CLOSE}

    def _away(self, state: WorldState) -> float:
        return math.dist(tip(state), self.target)


class ReachGoal(GoalTask):
    """The tip goes to a goal; the reward only says whether it is there. For hindsight experience replay.

    ## Action space
    As in `Reach`.

    ## Observation space
    `Dict`

    | key | space | what it is | unit |
    |---|---|---|---|
    | `observation` | `Box((6,))` | cosine and sine of shoulder and elbow; their speeds | 1; 3 rad/s |
    | `achieved_goal` | `Box(-10, 10, (2,))` | position of the tip from the shoulder, (x, y) | 0.1 m |
    | `desired_goal` | `Box(-10, 10, (2,))` | where it should be | 0.1 m |

    ## Rewards
    0 if the tip is within 0.02 m of the goal when the step is over, else -1.

    ## Start of an episode
    The arm's pose and the goal are drawn as in `Reach`.

    ## End of an episode
    Truncated after 50 steps of 0.04 s; never terminated.

    ## Info
    `is_success`: whether the tip is there.
    """

    max_steps = 50
    query = StateQuery(links=(LinkQuery("tip"),))

    def action_space(self) -> gymnasium.spaces.Box:
        return actions(2)

    def observation_space(self) -> gymnasium.spaces.Box:
        return numbers(6)

    def goals(self) -> gymnasium.spaces.Box:
        """Returns points of the plane (x, y) [0.1 m]."""
        return gymnasium.spaces.Box(-10.0, 10.0, (2,), np.float32)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        return draw_pose(rng)

    def goal(self, rng: np.random.Generator, state: WorldState) -> np.ndarray:
        """Draws a point that the tip can reach [0.1 m]."""
        return np.array(draw_target(rng), np.float32) / np.float32(GOAL_UNIT)

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, float]:
        return speeds(action)

    def observe(self, state: WorldState) -> np.ndarray:
        return np.array(joints(state), np.float32)

    def achieved(self, state: WorldState) -> np.ndarray:
        return np.array(tip(state), np.float32) / np.float32(GOAL_UNIT)

    def is_success(self, achieved: np.ndarray, desired: np.ndarray) -> np.ndarray:
        """Returns whether the tip is there; vectorised."""
        return np.linalg.norm(achieved - desired, axis=-1) <= CLOSE / GOAL_UNIT


def draw_pose(rng: np.random.Generator) -> InitialState:
    """Returns a pose at rest, away from the joints' stops."""
    shoulder, elbow = rng.uniform(-2.4, 1.6), rng.uniform(0.2, 2.4)
    return InitialState(joints={"shoulder": float(shoulder), "elbow": float(elbow)})


def draw_target(rng: np.random.Generator) -> tuple[float, float]:
    """Returns a point (x, y) [m] that the tip can reach; each as likely as any other."""
    radius = math.sqrt(rng.uniform(NEAREST**2, FURTHEST**2))
    bearing = rng.uniform(-WIDEST, WIDEST)
    return radius * math.cos(bearing), radius * math.sin(bearing)


def speeds(action: np.ndarray) -> dict[str, float]:
    """Returns the commands of the controllers [rad/s]."""
    shoulder, elbow = action * FASTEST
    return {"shoulder_controller": float(shoulder), "elbow_controller": float(elbow)}


def joints(state: WorldState) -> list[float]:
    """Returns the cosine and sine of shoulder and elbow, and their speeds [3 rad/s]."""
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
    """Returns the position of the tip in the plane, (x, y) [m]."""
    x, y, _ = state.links["tip"].pose.position
    return x, y
