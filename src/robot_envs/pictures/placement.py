"""Link poses of a state, surroundings, and a camera that sees all of it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from math import pi

import numpy as np

from robot_envs.backends.world_files import object_model, world_models
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_sim.physics.description import Joint, ModelDescription, Shape
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.pose import Pose, Vector, subtract
from robot_sim.pictures.camera import THIRD, Camera, CameraLike, overview
from robot_sim.pictures.visuals import boxes_of, moved, visible_shapes

GOAL = "goal of the task"  # model
PINK = (0.9, 0.1, 0.5, 1.0)
ABOVE, AMID = -60.0, 4.0 * THIRD  # pitch [degrees] and margin of pictures that show a goal
THICK, POLE, TALL = 0.01, 0.015, 0.6  # [m] of a goal's disc; radius and height of the pole in it

Shapes = list[tuple[str, Shape]]  # each with its link


class Surroundings:
    """What is visible besides the first robot: other robots, a task's objects and goal, the world's models.

    `ask` returns the poses of link frames, named model::link: of these, and of the first robot's links if it
    has joints that a state doesn't have. `goal` is the task's `goal_mark`.
    """

    def __init__(
        self,
        scene: Scene,
        ask: Callable[[Sequence[str]], Sequence[Pose]],
        goal: Callable[[], tuple[Vector, float] | None],
    ) -> None:
        self._scene, self._ask, self._goal = scene, ask, goal

    @cached_property
    def shapes(self) -> Mapping[str, Shapes]:
        """The visible shapes of each model, by its name."""
        first, *others = self._scene.robots
        models: dict[str, ModelDescription] = {robot.model: robot.links for robot in others}
        models |= {each.name: object_model(each) for each in self._scene.objects}
        models |= world_models(first.world)
        shapes = {name: visible_shapes(model) for name, model in models.items()}
        if (mark := self._goal()) is not None:
            shapes[GOAL] = _flag(mark[1])
        return {name: seen for name, seen in shapes.items() if seen}

    @property
    def robots(self) -> Sequence[Robot]:
        """The robots besides the first one."""
        return self._scene.robots[1:]

    def poses(self) -> dict[str, dict[str, Pose]]:
        """Returns the poses of links, by model."""
        asked = self._asked
        poses: dict[str, dict[str, Pose]] = {model: {} for model, _ in asked}
        if asked:
            names = [f"{model}::{link}" for model, link in asked]
            for (model, link), pose in zip(asked, self._ask(names), strict=True):
                poses[model][link] = pose
        if (mark := self._goal()) is not None:
            poses[GOAL] = {GOAL: Pose(mark[0])}
        return poses

    @cached_property
    def _asked(self) -> list[tuple[str, str]]:
        first = self._scene.robots[0]
        moved = {joint.name for joint in first.links.movable_joints}
        own = list(first.links.links) if moved - set(first.joints) else []
        links = [(first.model, link) for link in own]
        for model, shapes in self.shapes.items():
            if model == GOAL:  # which isn't in the world
                continue
            links += [(model, link) for link in dict.fromkeys(link for link, _ in shapes)]
        return links


def _flag(radius: float) -> Shapes:
    """Returns a disc on the floor, as wide as what counts as there [m], and a pole that is seen from afar."""
    sizes = ((radius, THICK), (POLE, TALL))
    return [(GOAL, Shape("cylinder", size, Pose((0.0, 0.0, size[1] / 2.0)), rgba=PINK)) for size in sizes]


QUARTERS = (0.0, pi / 2.0, pi, -pi / 2.0)  # [rad] of a joint without stops


class Placement:
    """A robot on a ground at z = 0, or above it, with its surroundings; `base` is its root link's pose."""

    def __init__(
        self, robot: Robot, base: Callable[[], Pose] | None = None, beside: Surroundings | None = None
    ) -> None:
        self._beside = beside
        self.name, self.description = robot.model, robot.links
        self.shapes = visible_shapes(self.description)
        self._start = robot.pose.compose(self.description.root_pose)
        self.base = base or (lambda: self._start)
        slides = [joint for joint in self.description.movable_joints if _goes_far(joint)]
        self._slides = {joint.name: 0.0 for joint in slides}
        self._carried = slides[-1].child if slides else None

    @property
    def models(self) -> dict[str, Shapes]:
        """The visible shapes of each model, the robot first."""
        return {self.name: self.shapes, **(self._beside.shapes if self._beside else {})}

    def poses(self, positions: Mapping[str, float], base: Pose) -> dict[str, dict[str, Pose]]:
        """Returns the frame of every link in the world, by model; positions are in [rad, m]."""
        others = self._beside.poses() if self._beside else {}
        own = {} if self.name in others else link_poses(self.description, base, positions)
        return {self.name: own, **others}

    def reach(self) -> np.ndarray:
        """Returns box corners around all that the robots' joints can reach from the start, (n, 3) [m]."""
        others = [Placement(each).reach() for each in self._beside.robots] if self._beside else []
        reached = [{}, *({joint.name: place} for joint, place in self._places())]
        return np.concatenate([self._corners(reached), *others])

    def _corners(self, reached: Sequence[Mapping[str, float]]) -> np.ndarray:
        """Returns box corners around the robot at its start with joints at these positions, (n, 3) [m]."""
        poses = [link_poses(self.description, self._start, each) for each in reached]
        corners = [
            moved(box, each[link].compose(pose))
            for link, pose, box in boxes_of(self.shapes)
            for each in poses
        ]
        return np.concatenate([np.zeros((0, 3)), *corners])

    def camera(self, camera: CameraLike, aspect: float) -> Camera:
        """Returns `camera`, or one that sees all that joints reach, or a vehicle as a third of the picture.

        A task's goal on the floor is seen from above, with more around the robot; `aspect` is width to
        height.
        """
        if isinstance(camera, Camera):
            return camera
        fields = camera or {}
        has_goal = self._beside is not None and GOAL in self._beside.shapes
        looking = (Camera(pitch=ABOVE) if has_goal else Camera()).changed(fields)
        if self.description.fixed_base:
            seen = overview(self.reach(), aspect, looking)
        else:
            margin = AMID if has_goal else THIRD
            seen = overview(self._corners([{}]), aspect, looking, margin)
        return seen.changed(fields)

    def travelled(self, positions: Mapping[str, float], base: Pose) -> Vector:
        """Returns how far it is from its start [m]: its root link, and along slides without near stops."""
        if self._carried is None:
            return subtract(base.position, self._start.position)
        here, there = (
            link_poses(self.description, pose, each)[self._carried].position
            for pose, each in ((self._start, {**positions, **self._slides}), (base, positions))
        )
        return subtract(there, here)

    def _places(self) -> Iterator[tuple[Joint, float]]:
        """Yields sample positions of the joints [rad, m]: at their stops, or all the way round."""
        for joint in self.description.movable_joints:
            if _has_near_stops(joint):
                yield from ((joint, joint.lower), (joint, joint.upper))
            elif not _goes_far(joint):
                yield from ((joint, place) for place in QUARTERS)


def _has_near_stops(joint: Joint) -> bool:
    return joint.bounded and joint.upper - joint.lower < 2.0 * pi


def _goes_far(joint: Joint) -> bool:
    return joint.kind == "prismatic" and not _has_near_stops(joint)
