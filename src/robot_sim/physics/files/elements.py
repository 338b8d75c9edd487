"""Numbers and names in XML model files; errors name the place."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from xml.etree.ElementTree import Element, SubElement

from file_access.content import FileError, TooLarge
from robot_sim.physics.description import DescriptionError, LimitExceeded, Plugin
from robot_sim.physics.pose import Pose, Vector, from_rpy, to_rpy

FRAME_TAGS = ("bodyName", "frameName")  # of plugins, where they name a link
OFFSETS = ("xyzOffset", "rpyOffset")
TINY = 1e-12  # [kg m²]; what rounding leaves of a moment of 0, with any sign
SHOWN = 80  # characters of a faulty value that an error quotes


@contextmanager
def place(where: str) -> Iterator[None]:
    """Prefixes `where` to the text of a DescriptionError that is raised in the block."""
    try:
        yield
    except DescriptionError as error:
        raise type(error)(f"{where}: {error}") from error


@contextmanager
def reading_files() -> Iterator[None]:
    """Turns errors over the content of files into those of descriptions."""
    try:
        yield
    except TooLarge as error:
        raise LimitExceeded(str(error)) from error
    except FileError as error:
        raise DescriptionError(str(error)) from error


@contextmanager
def files_named_by_a_model(where: str) -> Iterator[None]:
    """Turns the system's errors over strange file names, such as too long ones, into DescriptionError."""
    try:
        yield
    except DescriptionError:
        raise
    except (OSError, ValueError) as error:
        raise DescriptionError(f"{where}: {shown(str(error))}") from error


def finite(text: str, where: str) -> float:
    """Returns the number in `text`."""
    try:
        value = float(text)
    except ValueError as error:
        raise DescriptionError(f"{where}: '{shown(text)}' is not a number") from error
    if not math.isfinite(value):
        raise DescriptionError(f"{where}: '{shown(text)}' is not finite")
    return value


def numbers(text: str | None, where: str, count: int) -> tuple[float, ...]:
    """Returns `count` numbers separated by blanks. `where` names them in the error's text."""
    words = (text or "").split(None, count)  # a long text isn't split further
    if len(words) != count:
        raise DescriptionError(f"{where} must hold {count} numbers, not '{shown(text or '')}'")
    return tuple(finite(word, where) for word in words)


def direction(xyz: tuple[float, ...], what: str) -> Vector:
    """Returns a vector scaled to length 1; `what` it is, for the error about one that has no direction."""
    x, y, z = xyz
    length = math.sqrt(x * x + y * y + z * z)
    if not 0.0 < length < math.inf:
        raise DescriptionError(f"{what} has length {length:g}")
    return (x / length, y / length, z / length)


def mended(moments: dict[str, float]) -> dict[str, float]:
    """Returns moments of inertia [kg m²] with 0 in place of what rounding has left just below it."""
    return moments | {key: 0.0 for key in ("ixx", "iyy", "izz") if -TINY <= moments[key] < 0.0}


def truth(text: str | None, default: bool = False) -> bool:
    """Returns the truth value of an element's text; `default` if it is empty."""
    word = (text or "").strip().lower()
    return word in ("true", "1") if word else default


def given(element: Element | None) -> str:
    """Returns the value of a URDF's extension: the attribute `value`, or else the text."""
    return "" if element is None else (element.get("value", element.text) or "").strip()


def named(element: Element, what: str) -> str:
    """Returns the attribute `name`."""
    name = element.get("name", "")
    if not name:
        raise DescriptionError(f"a <{what}> has no name")
    if what in ("link", "joint") and len(name.encode("utf-8", "replace")) > 1000:  # cut at 1023
        raise DescriptionError(f"{what} '{shown(name)}': the name is longer than 1000 bytes")
    return name


def shown(text: str) -> str:
    """Returns `text` as one line, cut to a length for an error."""
    line = " ".join(text[: 4 * SHOWN].split())
    return line if len(line) <= SHOWN else f"{line[:SHOWN]}…"


def positive(sizes: tuple[float, ...], where: str) -> tuple[float, ...]:
    """Returns `sizes` [m]."""
    if min(sizes) <= 0.0:
        raise DescriptionError(f"{where}: sizes must be above 0, not {sizes}")
    return sizes


def read_plugin(element: Element) -> Plugin:
    return Plugin(element.get("filename", ""), element.get("name", ""), element)


def rename_lumped(plugin: Element, lumped: Mapping[str, tuple[str, Pose]]) -> None:
    """Renames lumped links in a model's plugin, and gives it their poses as offsets, as sdformat does.

    See docs/contract/sensors.md 0.6.
    """
    tags = [each for each in map(plugin.find, FRAME_TAGS) if each is not None]
    renamed = [each for each in tags if (each.text or "").strip() in lumped]
    for element in renamed:
        element.text, pose = lumped[(element.text or "").strip()]
    if renamed:
        xyz, rpy = (numbers(plugin.findtext(tag, "0 0 0"), f"<{tag}>", 3) for tag in OFFSETS)
        pose = pose.compose(Pose((xyz[0], xyz[1], xyz[2]), from_rpy(*rpy)))
        for tag, values in zip(OFFSETS, (pose.position, to_rpy(pose.orientation)), strict=True):
            given = plugin.find(tag)
            offset = SubElement(plugin, tag) if given is None else given
            offset.text = " ".join(map(repr, values))
