"""The tree that links and joints form: one root, no loops."""

from collections import defaultdict
from collections.abc import Iterable
from typing import TypeVar

from bullet_gazebo.physics.description import DescriptionError, Joint, Link

MAX_LINKS = 1000  # in the file; robots have some hundreds, and melting fixed joints is quadratic

Named = TypeVar("Named", Link, Joint)


def unique(items: Iterable[Named], what: str) -> dict[str, Named]:
    """Returns `items` by name.

    Raises:
        DescriptionError: for a name that is there twice.
    """
    found: dict[str, Named] = {}
    for item in items:
        if item.name in found:
            raise DescriptionError(f"{what} '{item.name}' is there twice")
        found[item.name] = item
    return found


def check_count(links: int) -> None:
    """Refuses a model of too many links, before time is spent on them.

    Raises:
        DescriptionError: if there are more than MAX_LINKS.
    """
    if links > MAX_LINKS:
        raise DescriptionError(f"there are {links} links; up to {MAX_LINKS} are read (MAX_LINKS)")


def find_roots(links: dict[str, Link], joints: dict[str, Joint]) -> list[str]:
    """Returns the links that are nobody's child, in document order; all others hang from one of them.

    Raises:
        DescriptionError: for missing links, a link with two parents, and loops.
    """
    if not links:
        raise DescriptionError("there is no <link>")
    check_count(len(links))
    below = _children(links, joints)
    children = {name for names in below.values() for name in names}
    roots = [name for name in links if name not in children]
    if not roots:
        raise DescriptionError("the links form a loop: no link is without a parent joint")
    reached, todo = set(roots), list(roots)
    while todo:
        names = below[todo.pop()]
        reached.update(names)
        todo.extend(names)
    loop = [name for name in links if name not in reached]
    if loop:
        raise DescriptionError(f"links {loop[:10]} form a loop")
    return roots


def _children(links: dict[str, Link], joints: dict[str, Joint]) -> dict[str, list[str]]:
    below: dict[str, list[str]] = defaultdict(list)
    seen: set[str] = set()
    for joint in joints.values():
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise DescriptionError(f"joint '{joint.name}': {role} link '{name}' does not exist")
        if joint.child in seen:
            raise DescriptionError(f"link '{joint.child}' has more than one parent joint")
        seen.add(joint.child)
        below[joint.parent].append(joint.child)
    return below
