"""Navigation of a vehicle to a goal on the floor without collisions; for robots of any package."""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import gymnasium
import numpy as np

from robot_envs.backends.world_files import world_models
from robot_envs.controllers import TWIST, CommandPort
from robot_envs.errors import TaskError
from robot_envs.files import Source
from robot_envs.robot import Robot
from robot_envs.robots import actions, numbers
from robot_envs.task import Task
from robot_envs.world_state import InitialState, Motion, StateQuery, WorldState
from robot_sim.physics.description import ModelDescription
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.pose import Pose, Vector, from_rpy, rotate, to_rpy

UNIT = 0.3  # [m] that a range is compared with
THERE = 0.3  # [m] from the goal: it is reached
NEAR = 0.15  # [m] before it touches, where a reward says that it is near something
TRIES = 100
AT_ONCE = 64  # points that are drawn


class DriveToGoal(Task):
    """A vehicle drives to a goal without touching anything.

    Its controller takes cmd_vel, and limits it. Of the simulation it knows its own pose and speed, and of
    its sensors the laser; `policy_node.py` takes them from the odometry and the laser's topic.

    ## Action space
    `Box(-1, 1, (2,))`: speed ahead, from 0 (-1) to the controller's limit (1); angular speed, to its limit
    either way. At the goal it stops, whatever the action.

    ## Observation space
    `Box((ranges + 5,))`

    | numbers | what they are | unit |
    |---|---|---|
    | `ranges` | 0.3 m / range, the nearest one of each sector of the laser, in its order | 1 |
    | 3 | distance of the goal, at most 4 m; cosine and sine of its bearing | 4 m, 1 |
    | 2 | own speed ahead, and angular speed | their limits |

    ## Rewards
    2 for each metre that the goal comes nearer, -0.02 for each step, up to -0.2 for being within 15 cm of
    touching, 5 at the goal, -5 for touching.

    ## Start of an episode
    At rest, in any direction, at a free point of the world; the goal is another one, `nearest` to `furthest`
    away. Free points are `clearance` from all boxes, cylinders and spheres of the world's file, and from all
    that those of moving models can reach.

    ## End of an episode
    Terminated within 0.3 m of the goal, and when a ray is shorter than `touch`. Truncated after 150 steps.

    ## Info
    `distance`: of the goal [m]. `is_success`: whether it is there. `touched`.

    Args:
        robot: The vehicle, with one controller that takes cmd_vel.
        laser: Its sensor; None: it has none, and nothing is touched.
        ranges: Sectors of the laser, up to the number of its rays.
        world: A world file in place of the robot's.
        touch: Range of the laser at which the vehicle touches something [m].
        clearance: Clearance of starts and goals, from the vehicle's middle [m].
        nearest: Least distance of goals from the start [m].
        furthest: Largest distance of goals from the start [m].
    """

    non_persistent = ("robot", "port", "floor")
    max_steps = 150
    action_names = ("ahead", "turn")

    def __init__(
        self, robot: Robot, laser: str | None, ranges: int = 24, world: Source | None = None,
        touch: float = 0.25, clearance: float = 0.45, nearest: float = 1.5, furthest: float = 4.0,
    ) -> None:  # fmt: skip
        if laser and not (isinstance(ranges, int) and ranges > 0):
            raise TaskError(f"ranges is a whole number from 1, not {ranges}")
        if not (math.inf > furthest > nearest >= 0.0 and math.inf > min(touch, clearance) >= 0.0):
            raise TaskError(
                f"touch ({touch}), clearance ({clearance}) and nearest ({nearest}) are lengths from 0 [m], "
                f"and furthest ({furthest}) is a longer one than nearest"
            )
        self.robot, self.laser, self.world = robot, laser, world
        self.ranges = ranges if laser else 0
        self.touch, self.clearance = touch, clearance
        self.nearest, self.furthest = nearest, furthest
        self.goal = (furthest, 0.0)
        self._before: float | None = None  # [m] of the goal, one step ago
        self.query = StateQuery(models=(robot.model,), sensors=(laser,) if laser else ())

    @cached_property
    def port(self) -> CommandPort:
        """The controller that takes cmd_vel; raises TaskError if there isn't one."""
        ports = [each for each in self.robot.ports if each.quantity == TWIST]
        if len(ports) != 1:
            raise TaskError(f"the robot '{self.robot.model}' needs one controller with cmd_vel")
        return ports[0]

    @cached_property
    def fastest(self) -> tuple[float, float]:
        """What an action of 1 asks for: ahead [m/s] and turning [rad/s]; 1 where nothing limits it."""
        (_, ahead), _, (_, turn) = self.port.bounds
        return (ahead if ahead < math.inf else 1.0), (turn if turn < math.inf else 1.0)

    @cached_property
    def floor(self) -> "Floor":
        """Where the vehicle can be."""
        world = self.robot.world if self.world is None else self.world
        return Floor(world_models(world), self.furthest)

    def action_space(self) -> gymnasium.spaces.Box:
        return actions(2)

    def observation_space(self) -> gymnasium.Space[Any]:
        return numbers(self.ranges + 5)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        """Draws where the vehicle starts, and the goal."""
        x, y = start = self.floor.draw(rng, self.clearance)
        self.goal = self.floor.draw(rng, self.clearance, start, (self.nearest, self.furthest))
        self._before = None
        turn = from_rpy(0.0, 0.0, float(rng.uniform(-math.pi, math.pi)))
        pose = Pose((x, y, self.robot.pose.position[2]), turn)
        return InitialState(models={self.robot.model: pose})

    def aim(self, goal: Sequence[float]) -> None:
        """Gives it another goal (x, y) [m], in the frame of its pose; raises ValueError for anything else."""
        if len(goal) != 2 or not all(map(math.isfinite, goal)):
            raise ValueError(f"a goal is (x, y) [m], not {tuple(goal)}")
        self.goal = (float(goal[0]), float(goal[1]))

    def goal_mark(self) -> tuple[Vector, float]:
        return (*self.goal, 0.0), THERE

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, tuple[float, ...]]:
        self._before = self.distance(state)
        if self._before <= THERE:
            return {self.port.name: (0.0, 0.0, 0.0)}
        ahead, turn = action.tolist()
        fast, round_ = self.fastest
        return {self.port.name: (0.5 * (ahead + 1.0) * fast, 0.0, turn * round_)}

    def observe(self, state: WorldState) -> Any:
        seen = [] if self.laser is None else self._sectors(state.sensors[self.laser].ranges)
        return np.array([*seen, *self.way(state)], np.float32)

    def _sectors(self, ranges: np.ndarray) -> list[float]:
        edges = np.arange(self.ranges) * len(ranges) // self.ranges
        # A range of -inf is too near, NaN a faulty ray.
        nearest = np.fmin.reduceat(np.maximum(ranges, 0.1), edges)
        return (UNIT / nearest).tolist()

    def way(self, state: WorldState) -> list[float]:
        """Returns distance [4 m], cosine and sine of the goal's bearing, and the speeds [their limits]."""
        (pose, twist), (fast, round_) = self._motion(state), self.fastest
        x, y, _ = pose.position
        bearing = math.atan2(self.goal[1] - y, self.goal[0] - x) - to_rpy(pose.orientation)[2]
        way = rotate(pose.orientation, (1.0, 0.0, 0.0))
        ahead = math.fsum(a * b for a, b in zip(way, twist.linear, strict=True))
        return [
            min(self.distance(state) / 4.0, 1.0), math.cos(bearing), math.sin(bearing),
            ahead / fast, twist.angular[2] / round_,
        ]  # fmt: skip

    def _motion(self, state: WorldState) -> Motion:
        return state.models[self.robot.model]

    def distance(self, state: WorldState) -> float:
        """Returns how far the goal is [m]."""
        return math.dist(self._motion(state).pose.position[:2], self.goal)

    def room(self, state: WorldState) -> float:
        """Returns what lies between the vehicle and the nearest thing [m]; 0 or less: it touches."""
        if self.laser is None:
            return math.inf
        return float(np.fmin.reduce(state.sensors[self.laser].ranges)) - self.touch

    def is_terminal(self, state: WorldState) -> bool:
        return self.distance(state) <= THERE or self.room(state) <= 0.0

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        distance, room = self.distance(state), self.room(state)
        gained = 0.0 if self._before is None else self._before - distance
        reward = 2.0 * gained - 0.02 - 0.2 * max(0.0, 1.0 - max(room, 0.0) / NEAR)
        if room <= 0.0:
            return reward - 5.0
        return reward + 5.0 if distance <= THERE else reward

    def info(self, state: WorldState) -> dict[str, Any]:
        distance, touched = self.distance(state), self.room(state) <= 0.0
        there = distance <= THERE and not touched
        return {"distance": distance, "is_success": there, "touched": touched}


class Floor:
    """What stands on the floor of a world, seen from above; planes and meshes don't count.

    Points are up to `size` [m] from things that span less, or from the origin.
    """

    def __init__(self, models: Mapping[str, ModelDescription], size: float) -> None:
        boxes = [box for model in models.values() for box in _boxes(model)]
        self._boxes = np.array(boxes).reshape(-1, 5)
        middles = self._boxes[:, :2] if boxes else np.zeros((1, 2))
        low, high = middles.min(axis=0), middles.max(axis=0)
        margin = np.where(high - low < size, size, 0.0)
        self.low, self.high = low - margin, high + margin

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Returns how far points (n, 2) [m] are from the nearest thing [m]; 0 in it."""
        x, y, along, across, yaw = self._boxes.T
        dx, dy = points[:, :1] - x, points[:, 1:] - y
        cos, sin = np.cos(yaw), np.sin(yaw)
        ahead = np.maximum(np.abs(cos * dx + sin * dy) - along, 0.0)
        aside = np.maximum(np.abs(cos * dy - sin * dx) - across, 0.0)
        return np.hypot(ahead, aside).min(axis=1, initial=math.inf)

    def draw(
        self,
        rng: np.random.Generator,
        clearance: float,
        start: tuple[float, float] | None = None,
        away: tuple[float, float] = (0.0, math.inf),
    ) -> tuple[float, float]:
        """Draws a free point (x, y) [m], `away` from `start` [m]; raises TaskError if none is found."""
        for _ in range(TRIES):
            points = rng.uniform(self.low, self.high, (AT_ONCE, 2))
            fit = self.clearance(points) >= clearance
            if start is not None:
                ways = np.hypot(*(points - start).T)
                fit &= (ways >= away[0]) & (ways <= away[1])
            if fit.any():
                x, y = points[fit.argmax()].tolist()
                return x, y
        raise TaskError(f"the world has no free point with a clearance of {clearance:g} m")


def _boxes(model: ModelDescription) -> Iterator[tuple[float, ...]]:
    """Yields rectangles around a model's shapes: middle (x, y), half sides [m], and yaw [rad]."""
    root = model.initial_pose.compose(model.root_pose)
    for link, place in link_poses(model, root, {}).items():
        for shape in model.links[link].collisions:
            if shape.kind not in ("box", "cylinder", "sphere"):
                continue
            is_box = shape.kind == "box"
            along, across = (0.5 * shape.size[0], 0.5 * shape.size[1]) if is_box else shape.size[:1] * 2
            pose = place.compose(shape.pose)
            x, y, _ = pose.position
            if not model.fixed_base or model.movable_joints:
                reach = math.dist(pose.position[:2], root.position[:2]) + math.hypot(along, across)
                (x, y, _), along, across = root.position, reach, reach
            yield x, y, along, across, to_rpy(pose.orientation)[2]
