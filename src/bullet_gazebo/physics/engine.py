"""The interface between our physics world and the engine that integrates it."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

from bullet_gazebo.physics.description import ModelDescription
from bullet_gazebo.physics.pose import Pose, Vector

Twist = tuple[Vector, Vector]
"""Linear [m/s] and angular [rad/s] velocity in world axes."""


class Body(ABC):
    """A model inside the engine. Joints are the movable ones, in document order."""

    joint_names: tuple[str, ...]
    link_names: tuple[str, ...]

    @abstractmethod
    def joint_states(self) -> Sequence[Sequence[float]]:
        """Returns for each joint a sequence that starts with position [rad, m] and velocity [rad/s, m/s]."""

    @abstractmethod
    def apply_efforts(self, efforts: Sequence[float]) -> None:
        """Applies one effort [N m, N] to each joint during the next step only."""

    @abstractmethod
    def reset_joint(self, index: int, position: float, velocity: float = 0.0) -> None:
        """Puts joint `index` at `position` with `velocity`, without touching the other joints."""

    @abstractmethod
    def reset_base(self, pose: Pose, twist: Twist = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))) -> None:
        """Puts the root link's frame at `pose`, its origin moving with `twist`."""

    @abstractmethod
    def link_state(self, name: str) -> tuple[Pose, Twist]:
        """Returns pose and twist of the frame of link `name`, in the world."""


class Engine(ABC):
    """A dynamics engine with velocity-stepped articulated bodies."""

    @abstractmethod
    def load(self, description: ModelDescription, pose: Pose) -> Body:
        """Adds a model with its root link's frame at `pose`, its joints at zero.

        Errors: DescriptionError if the engine can't take it.
        """

    @abstractmethod
    def remove(self, body: Body) -> None:
        """Takes a body out of the world."""

    @abstractmethod
    def set_gravity(self, gravity: Vector) -> None:
        """Sets the acceleration of gravity [m/s²]."""

    @abstractmethod
    def set_time_step(self, dt: float) -> None:
        """Sets the length of a step [s]."""

    @abstractmethod
    def step(self) -> None:
        """Integrates the world by one time step."""

    @abstractmethod
    def close(self) -> None:
        """Frees the engine's memory; it can't be used afterwards."""
