"""The models of a `<population>`, and their poses."""

import math
from collections.abc import Iterator
from random import Random
from xml.etree.ElementTree import Element, SubElement

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.elements import named, numbers, positive, shown
from robot_sim.physics.files.sdf import renamed
from robot_sim.physics.files.sdf_parts import read_pose, value
from robot_sim.physics.pose import Pose, Vector, scale, to_rpy

GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # [rad]; turns by it fill a disc evenly
AXES = ("linear-x", "linear-y", "linear-z")


def clones(population: Element) -> Iterator[Element]:
    """Returns the models, under the names that Gazebo gives them, at the same places each time."""
    pose, _ = read_pose(population, "population")
    model = population.find("model")
    if model is None:
        raise DescriptionError("it has no <model>")
    name, turned = named(model, "model"), read_pose(model, "model")[0].orientation
    for number, offset in enumerate(_offsets(population)):
        clone = renamed(model, f"{name}_clone_{number}")
        clone[:] = [child for child in clone if child.tag != "pose"]
        words = *pose.compose(Pose(offset)).position, *to_rpy(turned)
        SubElement(clone, "pose").text = " ".join(map(repr, words))
        yield clone


def _offsets(population: Element) -> Iterator[Vector]:
    """Returns the positions [m] as seen from the middle of the region."""
    kind = (population.findtext("distribution/type") or "random").strip()
    if kind == "grid":
        rows, columns = (_count(population, f"distribution/{name}") for name in ("rows", "cols"))
        step = population.findtext("distribution/step", "0.5 0.5 0")
        return _grid(rows * columns, columns, *numbers(step, "<step>", 3)[:2])
    count, ((x, y, z), is_round) = _count(population, "model_count"), _region(population)
    if kind in AXES:
        along = [(x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)][AXES.index(kind)]
        return (scale(along, i / count - 0.5) for i in range(count))
    if kind == "uniform" and is_round:
        return (_on_disc(0.5 * x, (i + 0.5) / count, i * GOLDEN, 0.0) for i in range(count))
    if kind == "uniform":
        columns = max(1, round(min(count, math.sqrt(count * x / y))))
        return _grid(count, columns, x / columns, y / -(-count // columns))
    if kind != "random":
        raise DescriptionError(f"<type>: '{shown(kind)}' is no distribution")
    draws = Random(population.get("name", ""))
    shares = ([draws.random() for _ in range(3)] for _ in range(count))
    if is_round:
        return (_on_disc(0.5 * x, a, math.tau * b, z * (c - 0.5)) for a, b, c in shares)
    return ((x * (a - 0.5), y * (b - 0.5), z * (c - 0.5)) for a, b, c in shares)


def _region(population: Element) -> tuple[Vector, bool]:
    """Returns the sides [m] of the box, or of that around the upright cylinder, and whether it is one."""
    if (box := population.find("box")) is not None:
        x, y, z = positive(numbers(box.findtext("size", "1 1 1"), "<size>", 3), "<box>")
        return (x, y, z), False
    cylinder = population.find("cylinder")
    if cylinder is None:
        raise DescriptionError("it has neither a <box> nor a <cylinder>")
    size = [value(cylinder, name, "<cylinder>", 1.0) for name in ("radius", "length")]
    radius, length = positive(tuple(size), "<cylinder>")
    return (2.0 * radius, 2.0 * radius, length), True


def _grid(count: int, columns: int, x: float, y: float) -> Iterator[Vector]:
    """Returns points in rows along x, x and y [m] apart."""
    rows = -(-count // columns)
    return (
        (x * (i % columns - 0.5 * (columns - 1)), y * (i // columns - 0.5 * (rows - 1)), 0.0)
        for i in range(count)
    )


def _on_disc(radius: float, share: float, angle: float, height: float) -> Vector:
    """Returns the point that has a `share` of the disc's area within it."""
    out = radius * math.sqrt(share)
    return out * math.cos(angle), out * math.sin(angle), height


def _count(population: Element, path: str) -> int:
    count = value(population, path, "population", 1.0)
    if count < 1.0:
        raise DescriptionError(f"<{path}> is {count:g}, so it has no models")
    return int(count)
