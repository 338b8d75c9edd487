"""Options as fields of dataclasses, and their values from flags, YAML, parameters and KEY=VALUE.

A field made by `option` carries its default, help, limits and choices. `Options` reads values for the
fields of several dataclasses. Whatever the source, the same conversions and checks apply.
"""

import argparse
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, field, fields
from difflib import get_close_matches
from functools import partial
from importlib import import_module
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import yaml

from rl_workbench import errors
from rl_workbench.errors import WorkbenchError

_TOKEN = re.compile(r"(?P<open>[\[{])|(?P<close>[\]}])|(?P<between>[\s,]+)|.", re.DOTALL)


def option(
    default: Any,
    text: str,
    lowest: float = -math.inf,
    highest: float = math.inf,
    choices: tuple[str, ...] | None = None,
    metavar: str | None = None,
) -> Any:
    """Makes a dataclass field that knows its meaning and its limits.

    Args:
        default: A dict or a list is copied for each instance.
        text: For `--help`.
        lowest: The smallest number allowed.
        highest: The largest number allowed.
        choices: All values that a text may have.
        metavar: What `--help` calls the value; by default the last word of its name.
    """
    limits = None if (lowest, highest) == (-math.inf, math.inf) else (lowest, highest)
    metadata = {"help": text, "limits": limits, "choices": choices, "metavar": metavar}
    if isinstance(default, dict | list):
        return field(default_factory=default.copy, metadata=metadata)
    return field(default=default, metadata=metadata)


def check_options(instance: Any) -> None:
    """Checks every value of a dataclass of options against its limits and choices.

    Raises:
        WorkbenchError: If a value is outside them. NaN is outside of any limits.
    """
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
        """Adds a flag for each option. A flag that isn't given is absent from the result.

        Args:
            parser: Gets the flags.
            defaults: Defaults to show in `--help` where they differ from those of the dataclasses.
        """
        for name, each in self._fields.items():
            flag = f"--{name.replace('_', '-')}"
            default = (defaults or {}).get(name, None if each.default is MISSING else each.default)
            shown = "no default" if default is None or default == "" else f"default {default}"
            text = f"{each.metadata['help']} ({shown})".replace("%", "%%")
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
    """Returns what a flag names as module:attribute."""
    module, _, attribute = name.partition(":")
    if not module or not attribute:
        raise WorkbenchError(f"{flag} must be module:name, not {name!r}")
    try:
        return getattr(import_module(module), attribute)
    except ModuleNotFoundError as error:
        raise WorkbenchError(f"{flag} {name}: {error}; {errors.hints.finding_modules()}") from error
    except Exception as error:
        raise WorkbenchError(f"{flag} {name}: {errors.error_line(error)}") from error


def is_plain(value: Any) -> bool:
    """Returns whether JSON can represent a value exactly."""
    if isinstance(value, dict):
        return all(isinstance(key, str) and is_plain(each) for key, each in value.items())
    if isinstance(value, list):
        return all(is_plain(each) for each in value)
    if isinstance(value, float):
        return math.isfinite(value)
    return value is None or isinstance(value, bool | int | str)


def plain_value(value: Any) -> Any:
    """Reads a text as YAML. Unlike YAML it takes 1e-3 for a number, not only 1.0e-3.

    Raises:
        ValueError: If it isn't YAML.
    """
    if not isinstance(value, str):
        return value
    try:
        return _number_too(yaml.safe_load(value))
    except yaml.YAMLError:
        raise ValueError("a YAML value") from None


def _converted(kind: Any, value: Any) -> Any:
    """Converts a text or a YAML value. The text of a ValueError is what it should have been."""
    if NoneType in get_args(kind):
        kind = next(each for each in get_args(kind) if each is not NoneType)
    if get_origin(kind) is tuple:
        return _numbers(value, get_args(kind)[0])
    readers: dict[Any, Callable[[Any], Any]]
    readers = {bool: _switch, int: _whole, float: _number, str: str, Any: plain_value}
    return readers.get(kind, mapping)(value)


def _switch(value: Any) -> bool:
    words = {"true": True, "false": False}
    text = str(value).lower()
    if text not in words:
        raise ValueError("true or false")
    return words[text]


def _number(value: Any) -> float:
    try:
        if isinstance(value, bool):
            raise TypeError
        return float(value)
    except (ValueError, TypeError):
        raise ValueError("a number") from None


def _whole(value: Any) -> int:
    """Also reads 5e4 and 50_000, the way people write large numbers."""
    try:
        if isinstance(value, str) and value.strip().lstrip("+-").replace("_", "").isdigit():
            return int(value)  # exact, however large
        number = _number(value)
        if not number.is_integer():
            raise ValueError
        return value if isinstance(value, int) else int(number)
    except ValueError:
        raise ValueError("a whole number") from None


def _numbers(value: Any, kind: type) -> tuple[Any, ...]:
    items = value.strip("[]() ").split(",") if isinstance(value, str) else value
    if not isinstance(items, list | tuple):
        items = [items]
    try:
        return tuple((_whole if kind is int else _number)(item) for item in items)
    except ValueError:
        example = "whole numbers, as in 128,128" if kind is int else "numbers, as in 0.5,2"
        raise ValueError(example) from None


def mapping(value: Any) -> dict[str, Any]:
    """Reads a mapping, or a text such as `control_period=0.02, variation={mass: 0.2, gain: [0.9, 1.1]}`.

    Raises:
        ValueError: if it is neither; the text is what it should have been.
    """
    if isinstance(value, str):
        pairs = [pair.partition("=") for pair in _split(value)]
        try:
            value = {name: _number_too(yaml.safe_load(text)) for name, _, text in pairs}
        except yaml.YAMLError:
            value = None
        if not all(sign for _, sign, _ in pairs):  # a word without =
            value = None
    if not isinstance(value, dict):
        raise ValueError("KEY=VALUE, several with commas")
    return value


def _split(text: str) -> list[str]:
    """Splits at commas and spaces outside of brackets."""
    pieces, depth = [""], 0
    for found in _TOKEN.finditer(text):
        depth += bool(found["open"]) - bool(found["close"])
        if found["between"] and depth <= 0:
            pieces.append("")
        else:
            pieces[-1] += found[0]
    return [piece for piece in pieces if piece]


def _number_too(value: Any) -> Any:
    """Takes 1e-3 for a number everywhere inside a YAML value."""
    if isinstance(value, dict):
        return {name: _number_too(each) for name, each in value.items()}
    if isinstance(value, list):
        return [_number_too(each) for each in value]
    if not isinstance(value, str) or not value[-1:].isdigit():
        return value
    try:
        number = float(value)
    except ValueError:
        return value
    return int(number) if number.is_integer() and abs(number) >= 1 else number
