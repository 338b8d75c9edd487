"""How the links of a body touch in PyBullet: friction, and which links of a body meet each other."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

from bullet_gazebo.physics.description import DescriptionError, ModelDescription, Shape
from bullet_gazebo.physics.engine import Contact, Side
from bullet_gazebo.physics.engines.bullet.quiet_import import pybullet
from bullet_gazebo.physics.pose import Vector, add, scale


def set_friction(
    client: int,
    body: int,
    links: Mapping[str, int],
    description: ModelDescription,
    of: str | None = None,
    factor: float = 1.0,
) -> None:
    """Hands friction to the engine, which has one figure for a link (engine_form.py).

    Args:
        client: the world.
        body: the model's.
        links: the engine's number of each.
        description: in the engine's form.
        of: the link, with the pieces that it was split into; None: all.
        factor: of the description's friction.
    """
    for name, link in description.links.items():
        if name in links and link.collisions and of in (None, name, link.part_of):
            friction = factor * _friction(link.collisions[0], description.static)
            pybullet.changeDynamics(
                body, links[name], lateralFriction=friction, physicsClientId=client
            )


def choose_self_collisions(
    client: int, body: int, links: Mapping[str, int], description: ModelDescription
) -> None:
    """Lets two links of the model meet if either of them wants it, and no joint connects them (SDF's rule).

    The engine, asked for self-collision at all, lets all of them meet but parent and child.
    """
    if not collides_with_itself(description):
        return
    joined = {frozenset((joint.parent, joint.child)) for joint in description.joints.values()}
    solid = [link for name, link in description.links.items() if name in links and link.collisions]
    for a, b in combinations(solid, 2):
        owners = frozenset(link.part_of or link.name for link in (a, b))
        meet = (a.self_collide or b.self_collide) and len(owners) == 2 and owners not in joined
        pybullet.setCollisionFilterPair(
            body, body, links[a.name], links[b.name], int(meet), physicsClientId=client
        )


def collides_with_itself(description: ModelDescription) -> bool:
    """Returns whether any two links of the model could meet."""
    return any(link.self_collide for link in description.links.values())


def check_meshes(
    client: int, body: int, links: Mapping[str, int], description: ModelDescription
) -> None:
    """Refuses what the engine has left out without a word.

    Raises:
        DescriptionError: for a link whose meshes the engine has made nothing of.
    """
    for name, link in description.links.items():
        meshes = [shape.mesh for shape in link.collisions if shape.mesh]
        if name not in links or not meshes or len(meshes) < len(link.collisions):
            continue
        if not pybullet.getCollisionShapeData(body, links[name], client):
            raise DescriptionError(
                f"link '{name}': the physics engine finds nothing to touch in mesh '{meshes[0]}'"
            )


def _friction(shape: Shape, static: bool) -> float:
    """PyBullet multiplies the coefficients of two bodies where ODE takes the smaller one.

    What stands still counts as 1 at most, so that a box on a ground of 100 keeps its own coefficient.
    """
    return min(shape.mu, 1.0) if static else shape.mu


def contacts(client: int, sides: Mapping[tuple[int, int], Side]) -> list[Contact]:
    """Returns where bodies touched in the last step; not where they only are near.

    Args:
        client: the world.
        sides: what the engine's bodies and links are.
    """
    found = pybullet.getContactPoints(physicsClientId=client)
    return [_contact(each, sides) for each in found if each[9] > 0.0]


def _contact(found: Sequence[Any], sides: Mapping[tuple[int, int], Side]) -> Contact:
    """PyBullet tells links, not shapes; the point on the second body, and the normal towards the first."""
    _, first, second, first_link, second_link, _, point, normal, distance, force = found[:10]
    along, direction, across, other = found[10:14]
    friction: Vector = add(scale(direction, along), scale(other, across))
    return Contact(
        point, scale(normal, force), friction, normal, -distance,
        sides[first, first_link], sides[second, second_link],
    )  # fmt: skip
