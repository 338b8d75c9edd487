"""Options from texts: flags, rosparams, KEY=VALUE and YAML, all through the same checks."""

import argparse
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields
from difflib import get_close_matches
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import yaml

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options.mappings import read_mapping

# Options that earlier versions had.
RENAMED = {"algorithm": "algo", "stop_at": "stop_at_length", "n_envs": "num_envs"}


class Options:
    """The fields of one or more dataclasses, by name.

    Args:
        classes: dataclasses whose fields were made by `rl_workbench.option.option`.
    """

    def __init__(self, *classes: type) -> None:
        self._fields: dict[str, Field[Any]] = {}
        self._types: dict[str, Any] = {}
        for owner in classes:
            hints = get_type_hints(owner)
            for each in fields(owner):
                # The first one to have an option explains it; others of its name have its value.
                self._fields.setdefault(each.name, each)
                self._types.setdefault(each.name, hints[each.name])

    @property
    def names(self) -> list[str]:
        """All names, in the order of their definition."""
        return list(self._fields)

    def read(self, values: Mapping[str, Any], origin: str) -> dict[str, Any]:
        """Values as their options' types; '' and None leave an option as it is.

        Raises:
            WorkbenchError: if there is no such option, naming the nearest, or a value isn't of
                its type; `origin` says where it stands.
        """
        result = {}
        for name, value in values.items():
            if name not in self._fields:
                raise WorkbenchError(f"{origin}: {unknown_option(str(name), self.names)}")
            if value is None or value == "":
                continue
            try:
                result[name] = _converted(self._types[name], value)
            except (ValueError, TypeError) as error:
                raise WorkbenchError(f"{origin}: {name} must be {error}, not {value!r}") from error
        return result

    def make(self, owner: type, values: Mapping[str, Any]) -> Any:
        """One of the dataclasses, from those of the values that are its own.

        Raises:
            WorkbenchError: if a value is beyond its limits.
        """
        own = {each.name for each in fields(owner)}
        return owner(**{name: value for name, value in values.items() if name in own})

    def add_flags(
        self, parser: argparse._ActionsContainer, defaults: Mapping[str, Any] | None = None
    ) -> None:
        """A flag for each option; those that aren't given don't appear in the result.

        Args:
            defaults: where they aren't those of the dataclasses.
        """
        known = defaults or {}
        for name, each in self._fields.items():
            flag = f"--{name.replace('_', '-')}"
            text = f"{each.metadata['help']} ({_default(each, known)})".replace("%", "%%")
            if self._types[name] is bool:
                action = argparse.BooleanOptionalAction
                parser.add_argument(flag, action=action, default=argparse.SUPPRESS, help=text)
                continue
            metavar = each.metadata["metavar"] or name.rsplit("_", 1)[-1].upper()
            parser.add_argument(
                flag,
                type=self._argument_type(name),
                choices=each.metadata["choices"],
                default=argparse.SUPPRESS,
                metavar=None if each.metadata["choices"] else metavar,
                help=text,
            )

    def _argument_type(self, name: str) -> Callable[[str], Any]:
        def convert(text: str) -> Any:
            try:
                return _converted(self._types[name], text)
            except ValueError as error:
                raise argparse.ArgumentTypeError(f"must be {error}, not {text!r}") from error

        return convert


def unknown(kind: str, name: str, known: list[str]) -> str:
    """The words for a name that doesn't exist: the nearest one, or all."""
    near = get_close_matches(name, known, 1)
    hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
    return f"unknown {kind} {name!r}; {hint}"


def unknown_option(name: str, known: list[str], kind: str = "option") -> str:
    """The same for an option's name; one of an earlier version is told by that of today."""
    if name in RENAMED:
        return f"the {kind} {name} is called {RENAMED[name]} now"
    return unknown(kind, name, known)


def key_values(texts: list[str], origin: str) -> dict[str, str]:
    """KEY=VALUE texts as a dict.

    Raises:
        WorkbenchError: if one has no equals sign.
    """
    pairs = {}
    for text in texts:
        name, sign, value = text.partition("=")
        if not sign:
            raise WorkbenchError(f"{origin}: {text!r} isn't KEY=VALUE")
        pairs[name.strip().replace("-", "_")] = value.strip()
    return pairs


def _default(each: Field[Any], known: Mapping[str, Any]) -> str:
    value = known.get(each.name, None if each.default is MISSING else each.default)
    return "no default" if value is None or value == "" else f"default {value}"


def _converted(kind: Any, value: Any) -> Any:
    """A text or a YAML value as `kind`; ValueError carries what it should have been."""
    if NoneType in get_args(kind):
        kind = next(each for each in get_args(kind) if each is not NoneType)
    if kind is bool:
        return _switch(value)
    if kind is int:
        return _whole(value)
    if kind is float:
        return _number(value)
    if kind is str:
        return str(value)
    if kind is Any:
        return plain_value(value)
    if get_origin(kind) is tuple:
        return _sizes(value, get_args(kind)[0])
    return read_mapping(value)


def plain_value(value: Any) -> Any:
    """A text as a YAML value; 1e-3 is a number, too, which YAML writes 1.0e-3.

    Raises:
        ValueError: if it isn't one.
    """
    if not isinstance(value, str):
        return value
    try:
        value = yaml.safe_load(value)
    except yaml.YAMLError:
        raise ValueError("a YAML value") from None
    try:
        number = float(value) if isinstance(value, str) else value
    except ValueError:
        return value
    is_whole = isinstance(value, str) and number.is_integer() and abs(number) >= 1
    return int(number) if is_whole else number


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
    """Also 5e4 and 50_000, as people write large numbers."""
    try:
        number = _number(value)
        return int(value) if not isinstance(value, float) and _is_plain(value) else _exact(number)
    except (ValueError, OverflowError):
        raise ValueError("a whole number") from None


def _is_plain(value: Any) -> bool:
    return isinstance(value, int) or str(value).strip().lstrip("+-").replace("_", "").isdigit()


def _exact(number: float) -> int:
    if not number.is_integer():
        raise ValueError
    return int(number)


def _sizes(value: Any, kind: type) -> tuple[Any, ...]:
    items = value.strip("[]() ").split(",") if isinstance(value, str) else value
    if not isinstance(items, list | tuple):
        items = [items]
    try:
        return tuple((_whole if kind is int else _number)(item) for item in items)
    except ValueError:
        example = "whole numbers, as in 128,128" if kind is int else "numbers, as in 0.5,2"
        raise ValueError(example) from None
