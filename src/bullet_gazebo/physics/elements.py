"""Reading XML model files: guarded parsing, and numbers with the place that they stand at."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeVar
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from bullet_gazebo.physics.description import DescriptionError

MAX_DEPTH = 100  # nested elements; real models have about ten
SHOWN = 80  # characters of a faulty value that a message repeats

T = TypeVar("T")


class _GuardedBuilder(TreeBuilder):
    """Builds the tree, and refuses what only serves to exhaust the reader."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise DescriptionError("a document type (<!DOCTYPE>) is not taken")

    def start(self, tag: str, attributes: dict[str, str]) -> Element:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise DescriptionError(f"elements are nested more than {MAX_DEPTH} deep")
        return super().start(tag, attributes)

    def end(self, tag: str) -> Element:
        self._depth -= 1
        return super().end(tag)


def parse_xml(text: str) -> Element:
    """Returns the root element.

    Raises:
        DescriptionError: if it isn't well-formed or is a trap.
    """
    parser = XMLParser(target=_GuardedBuilder())
    try:
        parser.feed(text)
        root: Element = parser.close()
    except (ParseError, ValueError) as error:
        if isinstance(error, DescriptionError):
            raise
        raise DescriptionError(f"not well-formed XML: {error}") from error
    return root


@contextmanager
def place(where: str) -> Iterator[None]:
    """Puts `where` before the text of a DescriptionError that is raised inside."""
    try:
        yield
    except DescriptionError as error:
        raise DescriptionError(f"{where}: {error}") from error


def finite(text: str, where: str) -> float:
    """Returns the number in `text`.

    Raises:
        DescriptionError: if it is none; the text begins with `where`.
    """
    try:
        value = float(text)
    except ValueError as error:
        raise DescriptionError(f"{where}: '{shown(text)}' is not a number") from error
    if not math.isfinite(value):
        raise DescriptionError(f"{where}: '{shown(text)}' is not finite")
    return value


def numbers(text: str | None, where: str, count: int) -> tuple[float, ...]:
    """Returns `count` numbers separated by blanks. `where` names them in the error's text."""
    words = (text or "").split()
    if len(words) != count:
        raise DescriptionError(f"{where} must hold {count} numbers, not '{shown(text or '')}'")
    return tuple(finite(word, where) for word in words)


def truth(text: str | None, default: bool = False) -> bool:
    """Returns the truth value of an element's text; `default` if it is empty."""
    word = (text or "").strip().lower()
    return word in ("true", "1") if word else default


def named(element: Element, what: str) -> str:
    """Returns the attribute `name`.

    Raises:
        DescriptionError: if it is missing, or too long for the engine, which knows links and joints by it.
    """
    name = element.get("name", "")
    if not name:
        raise DescriptionError(f"a <{what}> has no name")
    if what in ("link", "joint") and len(name.encode("utf-8", "replace")) > 1000:  # cut at 1023
        raise DescriptionError(f"{what} '{shown(name)}': the name is longer than 1000 bytes")
    return name


def shown(text: str) -> str:
    """Returns `text` as one line, cut to a length that suits a message."""
    line = " ".join(text.split())
    return line if len(line) <= SHOWN else f"{line[:SHOWN]}…"


def positive(sizes: tuple[float, ...], where: str) -> tuple[float, ...]:
    """Returns `sizes` [m].

    Raises:
        DescriptionError: if one of them is not above zero.
    """
    if min(sizes) <= 0.0:
        raise DescriptionError(f"{where}: sizes must be above 0, not {sizes}")
    return sizes
