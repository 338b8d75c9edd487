"""Pictures of a robot from its state: the same for every backend, and without a display."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import pi
from typing import Generic

import numpy as np

from bullet_gazebo.physics.description import DescriptionError, Joint
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.mechanics.kinematics import link_poses
from bullet_gazebo.physics.pose import Pose, add, subtract
from bullet_gazebo.pictures.camera import Camera, overview
from bullet_gazebo.pictures.solids import visible_shapes
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot, State

__all__ = ["HEIGHT", "WIDTH", "Camera", "RobotPicture"]

WIDTH, HEIGHT = 640, 320  # [pixels], by default
LARGEST = 4096  # [pixels]
QUARTERS = (0.0, pi / 2.0, pi, -pi / 2.0)  # [rad] of a joint without stops


class RobotPicture(Generic[State]):
    """Draws a robot where a state says, on a ground; what it needs is loaded with the first picture.

    Args:
        robot: the robot.
        width: of the pictures [pixels].
        height: of the pictures [pixels].
        camera: where it is seen from, if it stood on the ground; by default so that all that the
            joints can reach is seen.
        raised: how far it stands above the ground [m].
        base: where the root link of a robot that isn't fixed is now; the camera follows it.

    Raises:
        ValueError: for a size that no picture has.
    """

    def __init__(
        self,
        robot: Robot[State],
        width: int = WIDTH,
        height: int = HEIGHT,
        *,
        camera: Camera | None = None,
        raised: float = 0.0,
        base: Callable[[], Pose] | None = None,
    ) -> None:
        for side in (width, height):
            if not 1 <= side <= LARGEST or side != int(side):
                raise ValueError(f"a picture's width and height lie in [1, {LARGEST}], not {side}")
        self._robot, self._size = robot, (int(width), int(height))
        self._camera, self._raised, self._base = camera, raised, base
        self._drawn: _DrawnRobot[State] | None = None

    def __call__(self, state: State) -> np.ndarray:
        """The robot in a state: (height, width, 3) of uint8.

        Raises:
            RobotEnvError: if the robot's file can't be read.
        """
        if self._drawn is None:
            self._drawn = _DrawnRobot(self._robot, self._raised, self._base)
            self._drawn.aim(self._camera, self._size)
        return self._drawn(state, self._size)

    def close(self) -> None:
        """Frees what it has loaded; may be called twice."""
        if self._drawn is not None:
            self._drawn.scene.close()
            self._drawn = None


class _DrawnRobot(Generic[State]):
    """A robot in a scene, and a camera."""

    def __init__(self, robot: Robot[State], raised: float, base: Callable[[], Pose] | None) -> None:
        from bullet_gazebo.pictures.scene import Scene  # loads PyBullet: when it is asked for

        self._joints, self._raised = robot.joints, raised
        try:
            self._description = parse_urdf(robot.urdf())
        except DescriptionError as error:
            raise RobotEnvError(f"the robot '{robot.model}': {error}") from error
        self._start = Pose((0.0, 0.0, raised)).compose(self._description.root_pose)
        self._base = None if self._description.fixed_base else base
        self.scene = Scene()
        self.scene.add("robot", visible_shapes(self._description))

    def aim(self, camera: Camera | None, size: tuple[int, int]) -> None:
        """Chooses what is seen: all that the joints can reach, one at a time, or what `camera` says."""
        if camera is None:
            corners = [self._corners({})]
            for joint in self._description.movable_joints:
                corners += [self._corners({joint.name: place}) for place in _places(joint)]
            camera = overview(np.concatenate(corners), size[0] / size[1])
        else:
            camera = replace(camera, target=add(camera.target, (0.0, 0.0, self._raised)))
        self._camera, self._offset = camera, subtract(camera.target, self._start.position)

    def _corners(self, positions: dict[str, float]) -> np.ndarray:
        self.scene.place("robot", link_poses(self._description, self._start, positions))
        return self.scene.corners("robot")

    def __call__(self, state: State, size: tuple[int, int]) -> np.ndarray:
        base = self._start if self._base is None else self._base()
        positions = dict(zip(self._joints, state[::2], strict=True))
        self.scene.place("robot", link_poses(self._description, base, positions))
        return self.scene.picture(self._camera.at(add(base.position, self._offset)), *size)


def _places(joint: Joint) -> Iterator[float]:
    """Some of where a joint can be [rad, m]: its stops, or all the way round."""
    if joint.bounded and joint.upper - joint.lower < 2.0 * pi:
        yield from (joint.lower, joint.upper)
    elif joint.kind != "prismatic":
        yield from QUARTERS
