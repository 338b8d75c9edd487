"""A robot's controllers: validation, loading, and the ports that take commands."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from file_access.text import did_you_mean, nearest_or_all
from robot_sim.control.controllers import find_type
from robot_sim.control.controllers.base import Controller
from robot_sim.control.controllers.vehicle import VehicleController
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.manager import STRICT, ControllerManager
from ros_calls.commands import COMMANDS, CommandKind

QUANTITIES = ("position", "velocity", "effort")  # that they command
TWIST = "twist"  # the quantity of a vehicle's command
Loaded = dict[str, Controller]


class CommandPort(NamedTuple):
    """How a controller is commanded."""

    name: str  # of the controller
    joints: tuple[str, ...]  # one number for each, in this order; of a vehicle fields of a Twist
    kind: CommandKind
    quantity: str  # what the numbers are: "position", "velocity", "effort"; of a vehicle "twist"
    bounds: tuple[tuple[float, float], ...] = ()  # of a vehicle's command, by axis [m/s, rad/s]

    @property
    def single(self) -> bool:
        """Whether it takes one number instead of a list."""
        return self.kind.single

    @property
    def holds(self) -> bool:
        """Whether it holds positions, so that an episode starts with those of its joints."""
        return self.quantity == QUANTITIES[0]

    def at_start(self, positions: Mapping[str, float]) -> float | tuple[float, ...]:
        """Returns what it holds when an episode starts: the joints' positions, or zeros."""
        values = tuple(positions[joint] if self.holds else 0.0 for joint in self.joints)
        return values[0] if self.single else values


def load(
    names: Sequence[str], parameters: Mapping[str, Any], hardware: RobotHardware
) -> tuple[ControllerManager, Loaded]:
    """Makes a manager, and loads controllers; raises ControlError if that fails."""
    manager = ControllerManager(hardware)
    return manager, {name: _load_one(manager, name, parameters) for name in names}


def _load_one(manager: ControllerManager, name: str, parameters: Mapping[str, Any]) -> Controller:
    if name not in parameters:
        raise ControlError(
            f"there is no controller '{name}' among its parameters{did_you_mean(name, parameters)}"
        )
    described = parameters[name]
    kind = described.get("type") if isinstance(described, Mapping) else None
    if not kind:
        raise ControlError(f"controller '{name}': its parameters have no type")
    if isinstance(kind, str) and kind not in manager.types:
        own = find_type(kind)  # a user's, found as the simulator finds it
        if own is None:
            near = did_you_mean(kind, manager.types)
            raise ControlError(f"controller '{name}': there is no type '{kind}'{near}")
        manager.types[kind] = own
    return manager.load(name, described)


def ports(
    commanded: Sequence[str] | None, parameters: Mapping[str, Any], loaded: Loaded
) -> list[CommandPort]:
    """Returns the ports of these controllers, None: all that take numbers; else raises ControlError."""
    if commanded is None:
        return [_port(each, parameters) for each in loaded.values() if _takes_numbers(each)]
    for name in commanded:
        if name not in loaded:
            raise ControlError(
                f"'{name}' is commanded, but not among the controllers that run{did_you_mean(name, loaded)}"
            )
        if not _takes_numbers(loaded[name]):
            raise ControlError(
                f"controller '{name}' ({loaded[name].type_name}) takes no numbers; tasks command "
                "controllers of single joints, of groups, or of vehicles"
            )
    return [_port(loaded[name], parameters) for name in commanded]


def _takes_numbers(controller: Controller) -> bool:
    kinds = [COMMANDS.get(str(each.kind)) for each in controller.inputs]
    return len(kinds) == 1 and kinds[0] is not None and bool(kinds[0].topic)


def _port(controller: Controller, parameters: Mapping[str, Any]) -> CommandPort:
    kind = COMMANDS[str(controller.inputs[0].kind)]
    if isinstance(controller, VehicleController):
        options = controller.options
        ranges = (options.linear.velocity, (0.0, 0.0), options.angular.velocity)
        bounds = tuple(each or (-math.inf, math.inf) for each in ranges)
        return CommandPort(controller.name, kind.fields, kind, TWIST, bounds)
    described = parameters[controller.name]
    listed = described.get("joints") or [described.get("joint")]
    joints = tuple(listed) if set(listed) == set(controller.claimed) else controller.claimed
    names = (controller.type_name.rpartition("/")[2], controller.interface)
    known = [each for name in names for each in QUANTITIES if each.capitalize() in name]
    # A user's type whose name has no quantity takes that of its interface.
    quantity = "position" if "position" in known else (known or QUANTITIES[2:])[0]
    return CommandPort(controller.name, joints, kind, quantity)


def faults(
    run: Sequence[str],
    commanded: Sequence[str] | None,
    parameters: Mapping[str, Any],
    hardware: RobotHardware,
    movable: Sequence[str],
) -> Iterator[str]:
    """Yields the faults of a robot's controllers.

    `commanded` are those that a task should command, None all that take numbers; `movable` are all movable
    joints, also those without a transmission.
    """
    manager = ControllerManager(hardware)
    loaded: Loaded = {}
    for name in dict.fromkeys(run):
        unknown = list(_unknown_joints(name, parameters.get(name), hardware, movable))
        yield from unknown
        try:
            if not unknown:
                loaded[name] = _load_one(manager, name, parameters)
        except ControlError as error:
            yield str(error)
        if list(run).count(name) > 1:
            yield f"the controllers to run name '{name}' twice"
    if len(loaded) < len(run):
        return
    try:
        ports(commanded, parameters, loaded)
        manager.switch(loaded, [], STRICT)
    except ControlError as error:
        yield str(error)


def _unknown_joints(
    name: str, described: Any, hardware: RobotHardware, movable: Sequence[str]
) -> Iterator[str]:
    """Yields a line for each joint of a controller that it can't have."""
    if not isinstance(described, Mapping):
        return
    listed = described.get("joints", described.get("joint", []))
    for joint in [listed] if isinstance(listed, str) else listed:
        if joint in hardware.joints:
            continue
        if joint in movable:
            yield f"controller '{name}': joint '{joint}' has no <transmission> in the URDF"
        else:
            near = nearest_or_all(str(joint), movable)
            yield f"controller '{name}': there is no joint '{joint}'{near}"
