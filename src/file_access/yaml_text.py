"""Parsing YAML files of parameters as rosparam does, within bounds of size, depth and number of values."""

import ast
import math
import operator
import re
from collections.abc import Callable
from datetime import datetime
from typing import Any

import yaml

from file_access.content import FileError, TooLarge

MAX_BYTES = 2**20  # takes the parser seconds; a robot's controllers have some kilobytes
MAX_VALUES = 100_000  # in lists and mappings, counted for each reference to an anchor
MAX_DEPTH = 50
MAX_ANGLE = 100  # characters
OPERATORS: dict[type, Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
SIMPLE = (str, int, float, bytes, datetime)  # types that the parameter server takes; bool is an int


def load_documents(data: bytes | str) -> list[Any]:
    """Returns the documents of a YAML text in UTF-8 or UTF-16; ``deg(90)`` and ``rad(pi/2)`` are radians.

    Raises FileError, with the place, if it isn't YAML or a value contains itself; TooLarge if it exceeds a
    bound, also with its anchors expanded.
    """
    if len(data) > MAX_BYTES:
        raise TooLarge(f"it has more than {MAX_BYTES} bytes (MAX_BYTES)")
    try:
        documents = list(yaml.load_all(data, _Loader))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise FileError(f"{place}{error.problem or error.context}") from error
    except (yaml.YAMLError, UnicodeError) as error:
        raise FileError(str(error)) from error
    except FileError:
        raise
    except ValueError as error:  # an invalid date or number, for which PyYAML gives no place
        raise FileError(f"a value can't be read: {error}") from error
    except RecursionError as error:
        raise TooLarge(f"values are nested more than {MAX_DEPTH} deep (MAX_DEPTH)") from error
    _count(documents, {}, 0)
    return documents


def load_parameters(data: bytes | str) -> list[dict[str, Any]]:
    """Returns the documents that are mappings of parameters; raises as `load_documents`, and FileError."""
    documents = [document for document in load_documents(data) if document is not None]
    for document in documents:
        if not isinstance(document, dict):
            raise FileError(f"expected 'name: value' lines, found {type(document).__name__}")
        for name, value in document.items():
            _check_sendable(value, str(name))
    return documents


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader with angles, and without merges that take exponential time."""

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        super().flatten_mapping(node)
        if len(node.value) > MAX_VALUES:  # merges of merges of merges
            raise TooLarge(f"there are more than {MAX_VALUES} values (MAX_VALUES)")

    def construct_angle(self, node: yaml.ScalarNode) -> float:
        text = str(self.construct_scalar(node)).strip()
        inner = text[4:-1] if text.startswith(("deg(", "rad(")) else text
        try:
            if len(inner) > MAX_ANGLE:
                raise ValueError
            angle = _evaluated(ast.parse(inner, mode="eval").body)
        except (ValueError, SyntaxError, ZeroDivisionError, OverflowError) as error:
            raise yaml.constructor.ConstructorError(
                problem=f"'{text[:MAX_ANGLE]}' is not an angle", problem_mark=node.start_mark
            ) from error
        return math.radians(angle) if node.tag == "!degrees" else angle


for _tag, _name in (("!degrees", "deg"), ("!radians", "rad")):
    _Loader.add_constructor(_tag, _Loader.construct_angle)
    _Loader.add_implicit_resolver(_tag, re.compile(rf"^{_name}\([^\)]*\)$"), first=[_name[0]])


def _evaluated(node: ast.expr) -> float:
    """Returns the value of an expression of numbers and pi."""
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return float(node.value)
    if isinstance(node, ast.Name) and node.id == "pi":
        return math.pi
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub)):
        value = _evaluated(node.operand)
        return -value if isinstance(node.op, ast.USub) else value
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        return OPERATORS[type(node.op)](_evaluated(node.left), _evaluated(node.right))
    raise ValueError


def _count(value: Any, known: dict[int, int | None], depth: int) -> int:
    """Returns the number of values in `value` with anchors expanded, without expanding them.

    `known` are counts by id; None for a value that is being counted: if it comes up, it contains itself.
    """
    if not isinstance(value, (list, dict, tuple, set)):
        return 1
    if depth > MAX_DEPTH:
        raise TooLarge(f"values are nested more than {MAX_DEPTH} deep (MAX_DEPTH)")
    if id(value) in known:
        count = known[id(value)]
        if count is None:
            raise FileError("a value contains itself")
        return count
    known[id(value)] = None
    total = 1 + sum(
        _count(each, known, depth + 1) for each in (value.values() if isinstance(value, dict) else value)
    )
    if total > MAX_VALUES:
        raise TooLarge(f"there are more than {MAX_VALUES} values (MAX_VALUES)")
    known[id(value)] = total
    return total


def _check_sendable(value: Any, place: str) -> None:
    if isinstance(value, dict):
        for name, each in value.items():
            if not isinstance(name, str):
                raise FileError(f"{place}: the name {name!r} is not a text: put it in quotes")
            _check_sendable(each, f"{place}/{name}")
    elif isinstance(value, list):
        for number, each in enumerate(value):
            _check_sendable(each, f"{place}[{number}]")
    elif value is None:
        raise FileError(f"{place} has no value")
    elif not isinstance(value, SIMPLE):
        raise FileError(f"{place}: a {type(value).__name__} can't be a parameter")
