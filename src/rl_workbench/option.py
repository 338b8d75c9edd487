"""Options as fields of dataclasses, and their values from flags, YAML, parameters and KEY=VALUE.

A field made by `option` carries its default, help, limits and choices. `Options` reads values for the
fields of several dataclasses. Whatever the source, the same conversions and checks apply.
"""

import argparse
import json
import math
import re
from collections.abc import Mapping
from dataclasses import MISSING, Field, field, fields
from difflib import get_close_matches
from functools import partial
from importlib import import_module
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import yaml

from rl_workbench import errors
from rl_workbench.errors import WorkbenchError

_KEY = re.compile(r"(?:^|[\s,]+)([A-Za-z_]\w*)=")


def option(
    default: Any,
    text: str,
    lowest: float = -math.inf,
    highest: float = math.inf,
    choices: tuple[str, ...] | None = None,
    metavar: str | None = None,
) -> Any:
    """Makes a dataclass field that knows its meaning and its limits.

    `text` and `metavar`, by default the last word of its name, are for `--help`. `choices` are all values
    that a text may have. A default that is a dict or a list is copied for each instance.
    """
    limits = None if (lowest, highest) == (-math.inf, math.inf) else (lowest, highest)
    metadata = {"help": text, "limits": limits, "choices": choices, "metavar": metavar}
    if isinstance(default, dict | list):
        return field(default_factory=default.copy, metadata=metadata)
    return field(default=default, metadata=metadata)


def check_options(instance: Any) -> None:
    """Raises WorkbenchError if an option is outside its limits, as NaN is, or none of its choices."""
    for each in fields(instance):
        value = getattr(instance, each.name)
        limits, choices = each.metadata.get("limits"), each.metadata.get("choices")
        if value is None:
            continue
        if limits and not limits[0] <= value <= limits[1]:
            lowest, highest = limits
            allowed = f"at least {lowest:g}" if highest == math.inf else None
            allowed = allowed or f"between {lowest:g} and {highest:g}"
            raise WorkbenchError(f"{each.name} must be {allowed}, not {value!r}")
        if choices and value not in choices:
            raise WorkbenchError(f"{each.name} must be one of {', '.join(choices)}, not {value!r}")


class Options:
    """The options of one or more dataclasses, by name.

    If two dataclasses have an option of the same name, the first one explains it and both get its value.
    """

    def __init__(self, *classes: type) -> None:
        self._fields: dict[str, Field[Any]] = {}
        self._types: dict[str, Any] = {}
        for owner in classes:
            hints = get_type_hints(owner)
            for each in fields(owner):
                self._fields.setdefault(each.name, each)
                self._types.setdefault(each.name, hints[each.name])

    @property
    def names(self) -> list[str]:
        """All names, in the order of their definition."""
        return list(self._fields)

    def read(self, values: Mapping[str, Any], origin: str) -> dict[str, Any]:
        """Converts values to the types of their options. It leaves out '' and None."""
        result = {}
        for name, value in values.items():
            if name not in self._fields:
                raise WorkbenchError(f"{origin}: {unknown('option', str(name), self.names)}")
            if value is None or value == "":
                continue
            try:
                result[name] = _converted(self._types[name], value)
            except (ValueError, TypeError) as error:
                raise WorkbenchError(f"{origin}: {name} must be {error}, not {value!r}") from error
        return result

    def make(self, owner: type, values: Mapping[str, Any]) -> Any:
        """Makes one of the dataclasses from those values that it has options for."""
        own = {each.name for each in fields(owner)}
        return owner(**{name: value for name, value in values.items() if name in own})

    def add_flags(
        self, parser: argparse._ActionsContainer, defaults: Mapping[str, Any] | None = None
    ) -> None:
        """Adds a flag for each option, whose default is SUPPRESS; `defaults` are shown in `--help`."""
        for name, each in self._fields.items():
            flag = f"--{name.replace('_', '-')}"
            default = (defaults or {}).get(name, None if each.default is MISSING else each.default)
            shown = "" if default in (None, "", {}, ()) else f" (default {default})"
            text = f"{each.metadata['help']}{shown}".replace("%", "%%")
            if self._types[name] is bool:
                action = argparse.BooleanOptionalAction
                parser.add_argument(flag, action=action, default=argparse.SUPPRESS, help=text)
                continue
            choices = each.metadata["choices"]
            metavar = each.metadata["metavar"] or name.rsplit("_", 1)[-1].upper()
            parser.add_argument(
                flag,
                type=partial(_flag_value, self._types[name]),
                choices=choices,
                default=argparse.SUPPRESS,
                metavar=None if choices else metavar,
                help=text,
            )


def _flag_value(kind: Any, text: str) -> Any:
    """Converts the text of a flag, with an error that argparse shows as it is."""
    try:
        return _converted(kind, text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"must be {error}, not {text!r}") from error


def unknown(kind: str, name: str, known: list[str]) -> str:
    """Returns an error text for an unknown name, with the nearest known one, or all of them."""
    near = get_close_matches(name, known, 1)
    hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
    return f"unknown {kind} {name!r}; {hint}"


def key_values(texts: list[str], origin: str) -> dict[str, str]:
    """Splits KEY=VALUE texts into a dict."""
    pairs = {}
    for text in texts:
        name, sign, value = text.partition("=")
        if not sign:
            raise WorkbenchError(f"{origin}: {text!r} isn't KEY=VALUE")
        pairs[name.strip().replace("-", "_")] = value.strip()
    return pairs


def imported(name: str, flag: str) -> Any:
    """Imports an attribute that a flag names as module:attribute."""
    module, _, attribute = name.partition(":")
    if not module or not attribute:
        raise WorkbenchError(f"{flag} must be module:name, not {name!r}")
    try:
        return getattr(import_module(module), attribute)
    except ModuleNotFoundError as error:
        raise WorkbenchError(f"{flag} {name}: {error}; {errors.hints.modules}") from error
    except Exception as error:
        raise WorkbenchError(f"{flag} {name}: {errors.error_line(error)}") from error


def is_plain(value: Any) -> bool:
    """Returns whether JSON can represent a value exactly."""
    try:
        return bool(json.loads(json.dumps(value, allow_nan=False)) == value)
    except (TypeError, ValueError):
        return False


def plain_value(value: Any) -> Any:
    """Reads a text as YAML, and 1e-3 and 5e4 as numbers, which YAML 1.1 doesn't; else raises ValueError."""
    if not isinstance(value, str):
        return value
    try:
        return _Loader(value).get_single_data()
    except yaml.YAMLError:
        raise ValueError("a YAML value") from None


class _Loader(yaml.SafeLoader):
    """Reads numbers with an exponent and no point, too."""


def _exponent(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int | float:
    number = float(str(node.value))
    return int(number) if number.is_integer() and abs(number) >= 1 else number


_Loader.add_constructor("!exponent", _exponent)
_Loader.add_implicit_resolver(
    "!exponent", re.compile(r"[-+]?\d[\d_]*(\.\d*)?[eE][-+]?\d+$"), list("-+0123456789")
)

EXPECTED = {bool: "true or false", int: "a whole number", float: "a number"}


def _converted(kind: Any, value: Any) -> Any:
    """Converts a text or a YAML value. The text of a ValueError is the expected form."""
    if NoneType in get_args(kind):
        kind = next(each for each in get_args(kind) if each is not NoneType)
    if get_origin(kind) is tuple:
        return _numbers(value, get_args(kind)[0])
    if kind is str:
        return str(value)
    if kind is not Any and kind not in EXPECTED:
        return mapping(value)
    read = plain_value(value)
    if kind is float and type(read) is int:
        return float(read)
    if kind is int and type(read) is float and read.is_integer():
        return int(read)
    if kind is not Any and type(read) is not kind:
        raise ValueError(EXPECTED[kind])
    return read


def _numbers(value: Any, kind: type) -> tuple[Any, ...]:
    items = value.strip("[]() ").split(",") if isinstance(value, str) else value
    items = items if isinstance(items, list | tuple) else [items]
    try:
        return tuple(_converted(kind, item) for item in items)
    except ValueError:
        example = "whole numbers, as in 128,128" if kind is int else "numbers, as in 0.5,2"
        raise ValueError(example) from None


def mapping(value: Any) -> dict[str, Any]:
    """Reads a mapping, or a text such as `control_period=0.02, variation={mass: 0.2, gain: [0.9, 1.1]}`."""
    if isinstance(value, str):
        first, *words = _KEY.split(value)
        try:
            pairs = zip(words[::2], words[1::2], strict=True)
            value = None if first else {name: plain_value(text) for name, text in pairs}
        except ValueError:
            value = None
    if not isinstance(value, dict):
        raise ValueError("KEY=VALUE, several with commas")
    return value
