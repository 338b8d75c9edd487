"""Where a picture is taken from."""

import math
from dataclasses import dataclass, replace

import numpy as np

from bullet_gazebo.physics.pose import Vector

NEAR, FAR = 0.02, 100.0  # of what is seen, as shares of the distance
AROUND = 1.1  # of what an overview has to show: a margin


@dataclass(frozen=True)
class Camera:
    """A camera that looks at a point; z is up.

    Args:
        target: the point [m].
        distance: from it [m].
        yaw: [degrees]; at 0 it looks along +y, with x to the right, at 90 along -x.
        pitch: [degrees]; negative looks down.
        view: height of what it sees, as an angle [degrees].
        follows: whether it goes with a robot that drives, in pictures of an environment.
    """

    target: Vector = (0.0, 0.0, 0.0)
    distance: float = 2.0
    yaw: float = 20.0
    pitch: float = -15.0
    view: float = 40.0
    follows: bool = True

    def at(self, target: Vector) -> "Camera":
        """The same camera looking at another point [m]: one that follows something."""
        return replace(self, target=target)

    @property
    def axes(self) -> np.ndarray:
        """Its right, up and forward in the world: rows of (3, 3)."""
        yaw, pitch = math.radians(self.yaw), math.radians(self.pitch)
        right = (math.cos(yaw), math.sin(yaw), 0.0)
        level = (-math.sin(yaw), math.cos(yaw))
        forward = (level[0] * math.cos(pitch), level[1] * math.cos(pitch), math.sin(pitch))
        return np.array([right, np.cross(right, forward), forward])

    @property
    def eye(self) -> np.ndarray:
        """Where it is [m]."""
        return np.array(self.target) - self.distance * self.axes[2]

    @property
    def near(self) -> float:
        """The least distance of what is seen [m]."""
        return NEAR * self.distance

    @property
    def far(self) -> float:
        """The greatest distance of what is seen [m]."""
        return FAR * self.distance

    @property
    def slope(self) -> float:
        """Half the height of what is seen, at a distance of 1."""
        return math.tan(math.radians(self.view) / 2.0)

    def view_matrix(self) -> np.ndarray:
        """From the world to the camera's axes, as OpenGL has them: (4, 4)."""
        right, up, forward = self.axes
        matrix = np.eye(4)
        matrix[:3, :3] = right, up, -forward
        matrix[:3, 3] = -matrix[:3, :3] @ self.eye
        return matrix

    def projection_matrix(
        self, width: int, height: int, region: tuple[int, int, int, int] | None = None
    ) -> np.ndarray:
        """From the camera's axes to OpenGL's cube: (4, 4).

        Args:
            width: of the picture [pixels].
            height: of the picture [pixels].
            region: left, top, right and bottom of what is wanted of it [pixels]; by default all.
        """
        near, far = self.near, self.far
        left, top, right, bottom = region or (0, 0, width, height)
        matrix, scale = np.zeros((4, 4)), height / self.slope
        matrix[0, 0], matrix[1, 1] = scale / (right - left), scale / (bottom - top)
        matrix[0, 2] = (left + right - width) / (right - left)
        matrix[1, 2] = (height - top - bottom) / (bottom - top)
        matrix[2, 2], matrix[2, 3] = (far + near) / (near - far), 2.0 * far * near / (near - far)
        matrix[3, 2] = -1.0
        return matrix


def overview(points: np.ndarray, aspect: float, looking: Camera | None = None) -> Camera:
    """A camera that sees all of `points` [m] (n, 3), in the direction of `looking`."""
    looking = looking or Camera()
    if not len(points):
        return looking
    low, high = points.min(axis=0), points.max(axis=0)
    x, y, z = ((low + high) / 2.0).tolist()
    right, up, forward = looking.axes
    seen = points - (x, y, z)
    # Each point, and how far away the camera has to be to see it.
    sideways, upright = abs(seen @ right) / aspect, abs(seen @ up)
    needed = np.maximum(sideways, upright) * AROUND / looking.slope - seen @ forward
    return replace(looking, target=(x, y, z), distance=max(float(needed.max()), 1e-3))
