"""Where a robot's links are in a state, and from where all of them are seen."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import pi
from typing import Generic

import numpy as np

from bullet_gazebo.physics.description import DescriptionError, Joint
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.mechanics.kinematics import link_poses
from bullet_gazebo.physics.pose import Pose, Vector, add, subtract
from bullet_gazebo.pictures.camera import Camera, overview
from bullet_gazebo.pictures.solids import box_around, moved, solid_of, visible_shapes
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot, State

QUARTERS = (0.0, pi / 2.0, pi, -pi / 2.0)  # [rad] of a joint without stops


class Placement(Generic[State]):
    """A robot that stands on a ground at z = 0, or above it.

    Args:
        robot: the robot.
        raised: how far it stands above the ground [m].
        base: where the root link of a robot that isn't fixed is now; None: where it starts.

    Raises:
        RobotEnvError: if the robot's file can't be read.
    """

    def __init__(self, robot: Robot[State], raised: float, base: Callable[[], Pose] | None) -> None:
        self.name, self._joints, self._raised = robot.model, robot.joints, raised
        try:
            self.description = parse_urdf(robot.urdf())
        except DescriptionError as error:
            raise RobotEnvError(f"the robot '{robot.model}': {error}") from error
        self.shapes = visible_shapes(self.description)
        self._start = Pose((0.0, 0.0, raised)).compose(self.description.root_pose)
        self._base = None if self.description.fixed_base else base

    def base(self) -> Pose:
        """The root link as it stands now.

        Raises:
            SimulatorError: if the backend has to be asked, and doesn't answer.
        """
        return self._start if self._base is None else self._base()

    def links(self, state: State, base: Pose) -> dict[str, Pose]:
        """The frame of every link in the world, for a state and where the root link stands."""
        return link_poses(self.description, base, dict(zip(self._joints, state[::2], strict=True)))

    def reach(self) -> np.ndarray:
        """Corners of boxes around all that the joints can reach from the start [m]: (n, 3)."""
        reached = [{}, *({joint.name: place} for joint, place in self._places())]
        poses = [link_poses(self.description, self._start, each) for each in reached]
        corners = [
            moved(box, each[link].compose(pose))
            for link, pose, box in self._boxes()
            for each in poses
        ]
        return np.concatenate([np.zeros((0, 3)), *corners])

    def camera(self, camera: Camera | None, aspect: float) -> Camera:
        """A camera that sees all that the joints can reach; or `camera`, raised with the robot.

        Args:
            camera: for the robot on the ground.
            aspect: of the pictures, width to height.
        """
        if camera is None:
            return overview(self.reach(), aspect)
        return replace(camera, target=add(camera.target, (0.0, 0.0, self._raised)))

    def strayed(self, base: Pose) -> Vector:
        """How far the root link has come from where it starts [m]."""
        return subtract(base.position, self._start.position)

    def _boxes(self) -> Iterator[tuple[str, Pose, np.ndarray]]:
        """Link, pose in it, and box around each shape that can be drawn."""
        for link, shape in self.shapes:
            try:
                yield link, shape.pose, box_around(solid_of(shape))
            except DescriptionError:
                continue  # who draws it tells

    def _places(self) -> Iterator[tuple[Joint, float]]:
        """Some of where the joints can be [rad, m]: at their stops, or all the way round."""
        for joint in self.description.movable_joints:
            if joint.bounded and joint.upper - joint.lower < 2.0 * pi:
                yield from ((joint, joint.lower), (joint, joint.upper))
            elif joint.kind != "prismatic":
                yield from ((joint, place) for place in QUARTERS)
