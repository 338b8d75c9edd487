"""KEY=VALUE texts of several options: values are YAML, and may hold lists and mappings of their own."""

import re
from typing import Any

import yaml

_PIECE = re.compile(r"""(?P<open>[\[{])|(?P<close>[\]}])|(?P<between>[\s,]+)|.""", re.DOTALL)


def read_mapping(value: Any) -> dict[str, Any]:
    """A mapping, or a text such as `backend=ros, randomisation={mass: 0.2, gravity: [0.9, 1.1]}`.

    Raises:
        ValueError: for anything else; it carries what it should have been.
    """
    if isinstance(value, str):
        pairs = [pair.partition("=") for pair in _split(value)]
        try:
            value = {name: _plain(yaml.safe_load(text)) for name, _, text in pairs}
        except yaml.YAMLError:
            value = None
        if not all(sign for _, sign, _ in pairs):
            value = None
    if not isinstance(value, dict):
        raise ValueError("KEY=VALUE, several with commas")
    return value


def _split(text: str) -> list[str]:
    """At commas and spaces, but for those in brackets."""
    pieces, depth = [""], 0
    for found in _PIECE.finditer(text):
        depth += bool(found["open"]) - bool(found["close"])
        if found["between"] and depth <= 0:
            pieces.append("")
        else:
            pieces[-1] += found[0]
    return [piece for piece in pieces if piece]


def _plain(value: Any) -> Any:
    """As YAML has it, but 1e-3 is a number."""
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, list):
        return [_plain(each) for each in value]
    try:
        return float(value) if isinstance(value, str) and value[-1:].isdigit() else value
    except ValueError:
        return value
