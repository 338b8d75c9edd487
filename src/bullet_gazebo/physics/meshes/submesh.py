"""One named part of a mesh file instead of all of it (SDF's `<submesh>`)."""

from collections.abc import Iterable
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import shown
from bullet_gazebo.physics.meshes.arrays import Part

MOST_NAMES = 10  # that are told where one isn't found


class Submesh(NamedTuple):
    """The part's name in the file, and whether the middle of its bounding box becomes its origin."""

    name: str
    centred: bool


def not_found(name: str, known: Iterable[str]) -> DescriptionError:
    """Says which parts there are instead."""
    others = sorted({each for each in known if each})
    names = ", ".join(f"'{shown(each)}'" for each in others[:MOST_NAMES])
    more = " and others" if len(others) > MOST_NAMES else ""
    return DescriptionError(
        f"it has no submesh '{shown(name)}', but {names or 'none with a name'}{more}"
    )


def leave_node(root: Element, name: str) -> None:
    """Takes out of a COLLADA tree, without name spaces, what nodes of other names show themselves.

    A node without a name has that of the one above it.

    Raises:
        DescriptionError: if nothing is left.
    """
    known: set[str] = set()

    def prune(element: Element, inherited: str) -> bool:
        own = element.get("name", inherited) if element.tag == "node" else inherited
        kept = False
        for child in list(element):
            if child.tag != "instance_geometry":
                kept |= prune(child, own)
            elif own == name:
                kept = True
            else:
                known.add(own)
                element.remove(child)
        return kept

    if not prune(root, ""):
        raise not_found(name, known)


def centred(parts: list[Part]) -> list[Part]:
    """The same, moved so that the middle of the bounding box lies at the origin."""
    used = [vertices[np.unique(faces)] for vertices, faces in parts if len(faces)]
    if not used:
        return parts
    points = np.concatenate(used)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return [(vertices - middle, faces) for vertices, faces in parts]
