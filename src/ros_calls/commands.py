"""Commands of controllers: the ROS messages that carry them, and the fields of their numbers.

Names of messages and fields alone: importing it needs no ROS.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any


@dataclass(frozen=True)
class CommandKind:
    """A kind of command that consists of numbers."""

    message: str  # type of the topic's messages
    fields: tuple[str, ...] = ("data",)  # those with the numbers, in order
    topic: str = "command"  # by which tasks and steps command a controller; "" for none
    listed: bool = False  # whether the only field is a list, with a number for each joint

    @property
    def single(self) -> bool:
        """Whether a command is one number instead of a sequence."""
        return len(self.fields) == 1 and not self.listed

    @cached_property
    def message_type(self) -> Any:
        """The class of the messages."""
        package, _, name = self.message.partition("/")
        return getattr(importlib.import_module(f"{package}.msg"), name)

    def count(self, joints: int) -> int:
        """Returns how many numbers command a controller of so many joints."""
        return joints if self.listed else len(self.fields)

    @cached_property
    def read(self) -> Callable[[Any], Any]:
        """Takes the command out of a message."""
        return attrgetter(*self.fields)

    def write(self, command: Any) -> Any:
        """Returns the message that carries a command."""
        message = self.message_type()
        numbers: list[Any] = self.numbers(command)
        for field, value in zip(self.fields, [numbers] if self.listed else numbers, strict=True):
            owner, _, name = field.rpartition(".")
            setattr(attrgetter(owner)(message) if owner else message, name, value)
        return message

    def numbers(self, command: Any) -> list[float]:
        """Returns the numbers of a command."""
        return [command] if self.single else list(command)


COMMANDS = {  # by the name that a controller's input has for it
    "Float64": CommandKind("std_msgs/Float64"),
    "Float64MultiArray": CommandKind("std_msgs/Float64MultiArray", listed=True),
    "Twist": CommandKind("geometry_msgs/Twist", ("linear.x", "linear.y", "angular.z"), "cmd_vel"),
    "FourWheelSteering": CommandKind(
        "four_wheel_steering_msgs/FourWheelSteering",
        ("speed", "front_steering_angle", "rear_steering_angle"),
        topic="",
    ),
}
