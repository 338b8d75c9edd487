"""Parameters of controllers, declared as fields of dataclasses: reading, errors, documentation."""

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, NamedTuple, Self, dataclass_transform

from robot_sim.control.errors import ControlError
from robot_sim.control.pid import is_number

EACH = "<joint>"  # in a key: the name of each joint


class Declared(NamedTuple):
    """What is said of a parameter by `parameter`."""

    about: str
    default: Any
    read: Callable[[Any, str], Any]
    key: str


def parameter(
    about: str, default: Any = MISSING, read: Callable[[Any, str], Any] | None = None, key: str = ""
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
        """Returns the description of each parameter by the field's name."""
        said = {each.name: each.metadata[""] for each in fields(cls)}  # type: ignore[arg-type]
        return {name: each._replace(key=each.key or name) for name, each in said.items()}

    @classmethod
    def read(cls, params: Mapping[str, object], name: str, joint: str = "") -> Self:
        """Reads the parameters of controller `name`, those of each joint for `joint`.

        Raises ControlError if one is missing or wrong.
        """
        values = {}
        for attribute, declared in cls.declared().items():
            tree, place = params, name
            parts = [joint if each == EACH else each for each in declared.key.split("/")]
            for part in parts[:-1]:
                place = f"{place}/{part}"
                tree = mapping(tree.get(part, {}), place)
            value, key = tree.get(parts[-1]), f"{place}/{parts[-1]}"
            is_absent = parts[-1] not in tree and declared.default is not MISSING
            values[attribute] = declared.default if is_absent else declared.read(value, key)
        return cls(**values)


def reader(
    holds: Callable[[Any], bool],
    fault: str,
    convert: Callable[[Any], Any] = lambda value: value,
    before: Callable[[Any, str], Any] | None = None,
) -> Callable[[Any, str], Any]:
    """Returns a reader of what `holds`, or else has a `fault`; `before` reads it first."""

    def read(value: Any, key: str) -> Any:
        found = before(value, key) if before else value
        if not holds(found):
            raise ControlError(f"parameter {key} {fault}: {found!r}")
        return convert(found)

    return read


def are_names(value: Any) -> bool:
    """Whether a value is a list of names."""
    return isinstance(value, list) and all(isinstance(each, str) for each in value)


def of_type(kind: type) -> Callable[[Any, str], Any]:
    """Returns a reader of values of one type; a float is finite."""
    if kind is float:
        return number
    return reader(
        lambda value: isinstance(value, kind) and isinstance(value, bool) == (kind is bool),
        f"must be of type {kind.__name__}",
    )


SLOWEST = 1e-6  # [Hz]; below it, as at 0, nothing is ever published
number = reader(is_number, "is missing or is not a finite number", float)
truth = reader(lambda value: isinstance(value, bool), "must be true or false")
mapping = reader(lambda value: isinstance(value, Mapping), "must hold parameters by name")
length = reader(lambda value: 0.0 < value < math.inf, "must be above 0 and finite")
positive = reader(lambda value: value > 0.0, "must be above 0 and finite", before=number)
rate = reader(lambda value: value > SLOWEST, "must be more than 0 [Hz]", before=number)
name_list = reader(are_names, "must be a list of joint names", list)
joint_name = reader(lambda value: isinstance(value, str) and value != "", "is missing or is not a string")
joint_names = reader(
    lambda value: len(set(value)) == len(value), "names a joint twice", list,
    reader(lambda value: are_names(value) and value, "must be a list of joint names"),
)  # fmt: skip
wheel_names = reader(
    lambda value: are_names(value) and value, "must name a joint, or list some", list,
    lambda value, _: [value] if isinstance(value, str) else value,
)  # fmt: skip


class OneJoint(Parameters):
    joint: str = parameter("name of the joint", read=joint_name)


class SomeJoints(Parameters):
    joints: list[str] = parameter("names of the joints, in the order of commands", read=joint_names)
