"""What a robot is: its names, its files, and what of it an environment reads and commands."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from robot_envs import files
from robot_envs.errors import RobotEnvError

State = TypeVar("State", bound=tuple[float, ...])
"""A NamedTuple of floats: position and velocity of each joint [m, m/s] or [rad, rad/s]."""


@dataclass(frozen=True)
class OverRos:
    """What a robot is called over ROS; its files are the same as in this process.

    Args:
        description: the parameter that holds the URDF.
        publisher: the controller that publishes its joint states.
        rviz: package and name of the launch file that shows it in RViz; None: there is none.
    """

    description: str = "robot_description"
    publisher: str = "joint_state_controller"
    rviz: tuple[str, str] | None = None


@dataclass(frozen=True)
class Robot(Generic[State]):
    """A robot, wherever it moves.

    Args:
        model: its name in the world.
        state: makes the state that tasks see.
        joints: in the order in which the state has them.
        controllers: those that run, in the order in which they are started.
        commanded: those of them that an environment commands, in the order of a command's numbers;
            each takes one number.
        urdf_file: finds the URDF or xacro file in this process.
        parameters_file: finds the YAML file with the controllers' parameters in this process.
        ros: how it is brought up over ROS; None: in this process only.
        height: above the ground, where it is spawned over ROS [m]; enough for each of its tasks.

    Raises:
        ValueError: if the names don't go together.
    """

    model: str
    state: type[State]
    joints: tuple[str, ...]
    controllers: tuple[str, ...]
    commanded: tuple[str, ...]
    urdf_file: Callable[[], Path]
    parameters_file: Callable[[], Path]
    ros: OverRos | None = None
    height: float = 0.0

    def __post_init__(self) -> None:
        fields = self.state._fields  # type: ignore[attr-defined]  # of a NamedTuple
        if len(fields) != 2 * len(self.joints):
            raise ValueError(
                f"{self.state.__name__} has the numbers {', '.join(fields)}: position and velocity of "
                f"{', '.join(self.joints)} are {2 * len(self.joints)}"
            )
        idle = [name for name in self.commanded if name not in self.controllers]
        if idle:
            raise ValueError(f"commanded, but not among the controllers: {', '.join(idle)}")

    def urdf(self) -> str:
        """Its URDF, written out as the parameter robot_description has it.

        Raises:
            RobotEnvError: if the file isn't found, or can't be read.
        """
        return files.read_urdf(self.urdf_file())

    def parameters(self, controller: str) -> dict[str, Any]:
        """The parameters `/<controller>`.

        Raises:
            RobotEnvError: if the file isn't found, can't be read, or has no such controller.
        """
        path = self.parameters_file()
        found = files.read_parameters(path).get(controller)
        if not isinstance(found, dict):
            raise RobotEnvError(f"{path} has no controller '{controller}'")
        return found

    def state_of(self, numbers: Iterable[float]) -> State:
        """The state with these numbers: position and velocity of each joint."""
        return tuple.__new__(self.state, numbers)  # as its own _make, and twice as fast

    @property
    def over_ros(self) -> OverRos:
        """How it is brought up over ROS.

        Raises:
            RobotEnvError: if the description doesn't say.
        """
        if self.ros is None:
            raise RobotEnvError(f"the robot '{self.model}' doesn't say how it comes up over ROS")
        return self.ros
