"""Parameters of controllers, declared as fields of dataclasses: reading, errors, documentation."""

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, NamedTuple, Self, dataclass_transform

from robot_sim.control.errors import ControlError

EACH = "<joint>"  # in a key: the name of each joint


class Declared(NamedTuple):
    """What is said of a parameter by `parameter`."""

    about: str
    default: Any
    read: Callable[[Any, str], Any]
    key: str


def parameter(
    about: str,
    default: Any = MISSING,
    read: Callable[[Any, str], Any] | None = None,
    key: str = "",
) -> Any:
    """Declares a parameter, the field of a class of `Parameters`.

    Args:
        about: What it is, with unit and bounds, for documentation.
        default: Without it; MISSING if it is required.
        read: Returns what its value means, given its full name; None: what has the type of the default, or is
            a finite number. A required one that is missing has the value None.
        key: Its name below the controller's, with slashes and `EACH`; "" is that of the field.
    """
    kind = float if default is MISSING else type(default)
    return field(metadata={"": Declared(about, default, read or of_type(kind), key)})


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(parameter,))
class Parameters:
    """Parameters of a controller; docs/controllers.md has its tables from the subclasses, all dataclasses."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, kw_only=True)(cls)

    @classmethod
    def declared(cls) -> dict[str, Declared]:
        """Returns what is said of each, by the name of the field."""
        found = {each.name: each.metadata[""] for each in fields(cls)}  # type: ignore[arg-type]
        return {name: each._replace(key=each.key or name) for name, each in found.items()}

    @classmethod
    def read(cls, params: Mapping[str, object], name: str, joint: str = "") -> Self:
        """Reads the parameters of controller `name`, those of each joint for `joint`.

        Raises:
            ControlError: if one is missing or wrong.
        """
        found = {}
        for attribute, declared in cls.declared().items():
            tree, place = params, name
            parts = [joint if each == EACH else each for each in declared.key.split("/")]
            for part in parts[:-1]:
                place = f"{place}/{part}"
                tree = mapping(tree.get(part, {}), place)
            value, key = tree.get(parts[-1]), f"{place}/{parts[-1]}"
            is_absent = parts[-1] not in tree and declared.default is not MISSING
            found[attribute] = declared.default if is_absent else declared.read(value, key)
        return cls(**found)


def number(value: Any, key: str) -> float:
    """Reads a finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ControlError(f"parameter {key} is missing or is not a finite number: {value!r}")
    return float(value)


def of_type(kind: type) -> Callable[[Any, str], Any]:
    """Returns a reader of values of one type."""

    def read(value: Any, key: str) -> Any:
        if not isinstance(value, kind) or isinstance(value, bool) != (kind is bool):
            raise ControlError(f"parameter {key} must be of type {kind.__name__}: {value!r}")
        return value

    return number if kind is float else read


def truth(value: Any, key: str) -> bool:
    """Reads true or false."""
    if not isinstance(value, bool):
        raise ControlError(f"parameter {key} must be true or false: {value!r}")
    return value


def positive(value: Any, key: str) -> float:
    """Reads a length, or its multiplier."""
    return checked_length(number(value, key), key)


def checked_length(found: float, key: str) -> float:
    """Checks a length that is given, or comes from a description."""
    if not 0.0 < found < math.inf:
        raise ControlError(f"parameter {key} must be above 0 and finite: {found}")
    return found


def rate(value: Any, key: str) -> float:
    """Reads a rate [Hz] that isn't 0."""
    found = number(value, key)
    if found <= SLOWEST:
        raise ControlError(f"parameter {key} must be more than 0 [Hz]")
    return found


def mapping(value: Any, key: str) -> Mapping[str, Any]:
    """Reads parameters by name."""
    if not isinstance(value, Mapping):
        raise ControlError(f"parameter {key} must hold parameters by name: {value!r}")
    return value


def joint_name(value: Any, key: str) -> str:
    """Reads the name of a joint."""
    if not isinstance(value, str) or not value:
        raise ControlError(f"parameter {key} is missing or is not a string: {value!r}")
    return value


def joint_names(value: Any, key: str) -> list[str]:
    """Reads a list of joints."""
    if not are_names(value) or not value:
        raise ControlError(f"parameter {key} must be a list of joint names: {value!r}")
    if len(set(value)) < len(value):
        raise ControlError(f"parameter {key} names a joint twice: {value!r}")
    return list(value)


def wheel_names(value: Any, key: str) -> list[str]:
    """Reads the joint or the joints of wheels."""
    names = [value] if isinstance(value, str) else value
    if not are_names(names) or not names:
        raise ControlError(f"parameter {key} must name a joint, or list some: {value!r}")
    return list(names)


def are_names(value: Any) -> bool:
    """Whether a value is a list of names."""
    return isinstance(value, list) and all(isinstance(each, str) for each in value)


SLOWEST = 1e-6  # [Hz]; below it, as at 0, nothing is ever published


class OneJoint(Parameters):
    """Those of a controller of one joint."""

    joint: str = parameter("name of the joint", read=joint_name)


class SomeJoints(Parameters):
    """Those of a controller of several joints."""

    joints: list[str] = parameter("names of the joints, in the order of commands", read=joint_names)
