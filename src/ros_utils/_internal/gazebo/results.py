"""Results of several values, of which one says whether it succeeded. Part of `ros_gazebo`.

They unpack, compare and index as the tuples that clients know, and are false where that one is, so that
``if gazebo_spawn_urdf_path(...):`` means what it says.
"""

from __future__ import annotations

from typing import NamedTuple

from geometry_msgs.msg import Pose, Twist
from std_msgs.msg import Header


class SpawnResult(NamedTuple):
    """Whether a model was spawned, and the simulator's text or what went wrong before."""

    success: bool
    status_message: str

    def __bool__(self) -> bool:
        return self.success


class ModelStateResult(NamedTuple):
    """A model's pose [m, quaternion] and twist [m/s, rad/s]; all zeros without success."""

    header: Header
    pose: Pose
    twist: Twist
    success: bool

    def __bool__(self) -> bool:
        return self.success


class LinkStateResult(NamedTuple):
    """A link's pose [m, quaternion] and twist [m/s, rad/s]; all zeros without success."""

    pose: Pose
    twist: Twist
    success: bool

    def __bool__(self) -> bool:
        return self.success


class JointPropertiesResult(NamedTuple):
    """A joint's position [rad, m] and velocity [rad/s, m/s]; zeros without success."""

    position: float
    rate: float
    success: bool

    def __bool__(self) -> bool:
        return self.success


class WorldPropertiesResult(NamedTuple):
    """What is in the world: the simulated time [s], and the models' names."""

    success: bool
    sim_time: float
    model_names: list[str]

    def __bool__(self) -> bool:
        return self.success
