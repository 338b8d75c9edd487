"""Pictures of a robot from its state: the same for every backend, and without a display."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from bullet_gazebo.physics.pose import Pose, add
from bullet_gazebo.pictures.camera import Camera
from robot_envs.pictures.placement import Placement
from robot_envs.pictures.surroundings import Surroundings
from robot_envs.robot import Robot

if TYPE_CHECKING:
    from viser import ViserServer

    from robot_envs.pictures.page import RobotOnPage

__all__ = ["HEIGHT", "WIDTH", "Camera", "RobotPicture"]

WIDTH, HEIGHT = 640, 320  # [pixels], by default
LARGEST = 4096  # [pixels]


class RobotPicture:
    """Draws a robot where a state says, on a ground; what it needs is loaded with the first picture.

    Args:
        robot: the robot.
        width: of the pictures [pixels].
        height: of the pictures [pixels].
        camera: where it is seen from, as it is spawned; by default so that all that the joints can
            reach is seen.
        base: where its root link is now, which the camera follows; None: where it is spawned.
        beside: what else is in its world; None: nothing.

    Raises:
        ValueError: for a size that no picture has.
    """

    def __init__(
        self,
        robot: Robot,
        width: int = WIDTH,
        height: int = HEIGHT,
        *,
        camera: Camera | None = None,
        base: Callable[[], Pose] | None = None,
        beside: Surroundings | None = None,
    ) -> None:
        for side in (width, height):
            if not 1 <= side <= LARGEST or side != int(side):
                raise ValueError(f"a picture's width and height lie in [1, {LARGEST}], not {side}")
        self._size = (int(width), int(height))
        self._camera = camera
        self._placement = lambda: Placement(robot, base, beside)
        self._drawn: _DrawnRobot | None = None

    def __call__(self, positions: Mapping[str, float]) -> np.ndarray:
        """The robot with its joints at their positions [rad, m], by name: (height, width, 3) of uint8.

        Raises:
            RobotEnvError: if the robot's file can't be read.
        """
        if self._drawn is None:
            self._drawn = _DrawnRobot(self._placement(), self._camera, self._size)
        return self._drawn(positions)

    def draw_on(
        self, server: "ViserServer", positions: Callable[[], Mapping[str, float]], beside: int = 0
    ) -> "RobotOnPage":
        """Draws the robot on a page of viser's, where `positions` says; see `RobotEnv.draw_on`.

        Raises:
            RobotEnvError: if the robot's file can't be read.
        """
        from robot_envs.pictures.page import RobotOnPage

        return RobotOnPage(server, self._placement(), positions, self._camera, self._size, beside)

    def close(self) -> None:
        """Frees what it has loaded; may be called twice."""
        if self._drawn is not None:
            self._drawn.scene.close()
            self._drawn = None


class _DrawnRobot:
    """A robot in a scene, and a camera."""

    def __init__(self, placement: Placement, camera: Camera | None, size: tuple[int, int]) -> None:
        from bullet_gazebo.pictures.renderer import Renderer  # loads PyBullet

        self._placement, self._size = placement, size
        self._camera = placement.camera(camera, size[0] / size[1])
        self.scene = Renderer()
        for name, shapes in placement.models.items():
            self.scene.add(name, shapes)

    def __call__(self, positions: Mapping[str, float]) -> np.ndarray:
        base = self._placement.base()
        for name, poses in self._placement.poses(positions, base).items():
            self.scene.place(name, poses)
        camera = self._camera
        if camera.follows:
            camera = camera.at(add(camera.target, self._placement.strayed(positions, base)))
        return self.scene.picture(camera, *self._size)
