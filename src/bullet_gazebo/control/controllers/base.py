"""What a controller is: a life cycle, an update on each control tick, inputs and outputs."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar

from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.hardware import RobotHardware


class Output:
    """A topic that a controller writes to. `sink` is set by whoever listens, else records are not made.

    `topic` is relative to the controller's namespace, or to the manager's if `shared`.
    """

    __slots__ = ("kind", "shared", "sink", "topic")

    def __init__(self, topic: str, kind: str, shared: bool = False) -> None:
        self.topic = topic
        self.kind = kind
        self.shared = shared
        self.sink: Callable[[tuple], None] | None = None


class Input:
    """A topic that a controller reads, from load on. `receive` may be called from any thread."""

    __slots__ = ("kind", "receive", "topic")

    def __init__(self, topic: str, kind: str, receive: Callable[[float], None]) -> None:
        self.topic = topic
        self.kind = kind
        self.receive = receive


class Controller(ABC):
    """One controller (contract: ros_control.md sections 1 and 3). Times are in [ns], periods in [s]."""

    type_name: ClassVar[str]
    interface: ClassVar[str]

    def __init__(self, name: str) -> None:
        self.name = name
        self.state = "initialized"
        self.claimed: tuple[str, ...] = ()  # joint names, alphabetical
        self.inputs: list[Input] = []
        self.outputs: list[Output] = []

    @classmethod
    @abstractmethod
    def create(cls, name: str, params: Mapping, hardware: RobotHardware) -> "Controller":
        """Makes the controller from its parameters `<ns>/<name>`.

        Errors: ControlError if a parameter or a joint is missing or wrong.
        """

    def starting(self, now: int) -> None:
        """Called when the controller begins to run, and when a reset wants it to begin anew."""

    @abstractmethod
    def update(self, now: int, dt: float) -> None:
        """One control tick."""

    def stopping(self) -> None:
        """Called when the controller ceases to run; the joint's command stays as it is."""

    def joints_moved(self, now: int) -> None:
        """Called when something other than time changed the joints' state."""

    def command(self, value: float) -> None:
        """Takes a new command, as its command topic would.

        Errors: ControlError if this controller takes no single number.
        """
        raise ControlError(f"controller '{self.name}' ({self.type_name}) takes no single command")


def text_param(params: Mapping, key: str, place: str) -> str:
    """Returns the string parameter `key`; ControlError if it is missing or no string."""
    value = params.get(key)
    if not isinstance(value, str) or not value:
        raise ControlError(f"parameter {place}/{key} is missing or is not a string: {value!r}")
    return value


def number_param(params: Mapping, key: str, place: str) -> float:
    """Returns the numeric parameter `key`; ControlError if it is missing or no number."""
    value = params.get(key)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ControlError(
            f"parameter {place}/{key} is missing or is not a finite number: {value!r}"
        )
    return float(value)
