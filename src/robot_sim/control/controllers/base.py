"""The base of controllers: a life cycle, an update on each control tick, inputs and outputs."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from robot_sim.control.controllers.parameters import OneJoint, Parameters, number
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.joint import JointHandle
from robot_sim.control.pid import Loop, Pid, one_listener
from robot_sim.state_dict import Shared, Stateful


@dataclass(slots=True, eq=False)
class Output(Shared):
    """A topic that a controller publishes.

    `topic` is relative to the controller's namespace, or to the manager's if `shared`. `kind` is a ROS
    message type, whose messages are published as they are, or names one of the records that the ROS
    adapters convert: JointState, JointControllerState, ... With `whole` every one is sent, however fast
    the world runs.

    `sink` takes the records, once a ROS adapter has set it. `listeners` returns the number of subscribers,
    so that a controller needs to make no record without any.
    """

    topic: str
    kind: str | type
    shared: bool = False
    whole: bool = False
    sink: Callable[[Any], None] | None = None
    listeners: Callable[[], int] = one_listener

    @property
    def wanted(self) -> bool:
        """Whether there is a sink with listeners."""
        return self.sink is not None and self.listeners() > 0

    def send(self, record: Any) -> None:
        """Passes a record to `sink`, if there is one."""
        if self.sink is not None:
            self.sink(record)


@dataclass(slots=True, eq=False)
class Input(Shared):
    """A topic that a controller subscribes to when it is loaded.

    `kind` is Float64 (`receive` takes a number), Float64MultiArray (a sequence of numbers), Twist (what it
    says ahead, to the left and about), or a ROS message type (the message). `receive` is called between two
    ticks; a ControlError that it raises is logged. `publishers` returns how many there are.
    """

    topic: str
    kind: str | type
    receive: Callable[[Any], None]
    publishers: Callable[[], int] = one_listener


class Controller(Stateful, ABC):
    """A controller (docs/contract/ros_control.md 1 and 3). Times are in [ns], periods in [s].

    docs/controllers.md explains how to write one.
    """

    non_persistent: ClassVar[tuple[str, ...]] = ("name", "state", "claimed", "inputs", "outputs", "loops")
    type_name: ClassVar[str]
    interface: ClassVar[str]
    parameters: ClassVar[Sequence[type[Parameters]]] = ()  # that `create` reads

    def __init__(self, name: str) -> None:
        self.name = name
        self.state = "initialized"
        self.claimed: tuple[str, ...] = ()  # joint names, alphabetical
        self.inputs: list[Input] = []
        self.outputs: list[Output] = []
        self.pids: dict[str, Pid] = {}  # by namespace below the controller's; tunable while it runs
        # By name what dynamic_reconfigure changes while it runs: present value, least and most.
        self.tunables: dict[str, tuple[Any, Any, Any]] = {}
        self.loops: list[Loop] = []  # whose gains the physics step must be able to follow

    @classmethod
    @abstractmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> "Controller":
        """Creates the controller from its parameters `<ns>/<name>`.

        Raises ControlError if a parameter or a joint is missing or wrong.
        """

    @property
    def claims(self) -> Mapping[str, tuple[str, ...]]:
        """The claimed joints by hardware interface."""
        return {self.interface: self.claimed}

    def starting(self, now: int) -> None:
        """Called when the controller is started, and when a reset makes it start over."""

    @abstractmethod
    def update(self, now: int, dt: float) -> None:
        """Called on each control tick while the controller runs; it sets the joints' commands."""

    def stopping(self) -> None:
        """Called when the controller is stopped; its joints keep their commands."""

    def tune(self, values: Mapping[str, Any]) -> None:
        """Takes new values of `tunables`, all of them."""

    def joints_moved(self, now: int) -> None:
        """Called when a service or reset has moved the joints."""

    def restored(self) -> None:
        """Called when a snapshot was restored, with the attributes of that time."""


def number_param(params: Mapping[str, object], key: str, place: str) -> float:
    """Returns the numeric parameter `key`; raises ControlError if it is missing or not a finite number."""
    return number(params.get(key), f"{place}/{key}")


def joint_param(
    params: Mapping[str, object], name: str, interface: str, hardware: RobotHardware
) -> JointHandle:
    """Returns the joint that the parameter `joint` of controller `name` names.

    Raises ControlError if there is no such joint with that interface.
    """
    return hardware.joint(interface, OneJoint.read(params, name).joint)
