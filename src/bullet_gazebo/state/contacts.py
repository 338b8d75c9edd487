"""Which collisions of a world touch, as Gazebo's contact messages tell it: a record for each pair of them."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from bullet_gazebo.physics.engine import Side
from bullet_gazebo.physics.mechanics.surfaces import distance
from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import ZERO, Vector, add, cross, scale, subtract
from bullet_gazebo.physics.world import World
from bullet_gazebo.state.names import SCOPE, UnknownName, did_you_mean

Wrench = tuple[Vector, Vector]
"""Force [N] and torque [N m], in world axes."""
Collision = tuple[str, str, str]
"""Names of a model, its link, and the link's collision."""


@dataclass
class ContactPair:
    """Two collisions that touched in the last physics step, each as model::link::collision.

    There is one of each list for a point [m]. Normals, of length 1, point towards the first collision.
    Wrenches act on its link, their torques about its centre of mass. Depths [m] are those of the overlap.
    All is in world axes.
    """

    first: str
    second: str
    points: list[Vector] = field(default_factory=list)
    normals: list[Vector] = field(default_factory=list)
    wrenches: list[Wrench] = field(default_factory=list)
    depths: list[float] = field(default_factory=list)

    @property
    def total(self) -> Wrench:
        """The sum of the wrenches."""
        force, torque = ZERO, ZERO
        for each in self.wrenches:
            force, torque = add(force, each[0]), add(torque, each[1])
        return force, torque


def find_collisions(world: World, names: Iterable[str]) -> set[Collision]:
    """Returns all collisions that are meant by names.

    Args:
        world: where they are.
        names: of models, links and collisions; plain, or scoped as model::link and
            model::link::collision, which they must be where several models have one of that name.

    Raises:
        UnknownName: if one means no collision, or those of several models.
    """
    found: set[Collision] = set()
    for name in names:
        found |= _collisions_of(world, name)
    return found


def _collisions_of(world: World, name: str) -> set[Collision]:
    found = set()
    for model in world.models.values():
        for link in model.link_names:
            scoped = f"{model.name}{SCOPE}{link}"
            for collision in model.collisions(link):
                if name in world.models:
                    meant = name == model.name
                else:
                    meant = name in (link, scoped, collision, f"{scoped}{SCOPE}{collision}")
                if meant:
                    found.add((model.name, link, collision))
    if len({model for model, *_ in found}) > 1:
        raise UnknownName(
            f"several models have a link or collision '{name}'; write model::link or "
            "model::link::collision"
        )
    if not found:
        raise UnknownName(_why_none(world, name))
    return found


def _why_none(world: World, name: str) -> str:
    """Why a name means no collision."""
    if name in world.models:
        return f"model '{name}' has no collision"
    known = list(world.models)
    for model in world.models.values():
        plain = name.removeprefix(f"{model.name}{SCOPE}")
        if plain in model.link_names:
            return f"link '{name}' has no collision"
        if plain in model.description.lumped:
            link = model.description.lumped[plain][0]
            shapes = ", ".join(model.collisions(link)) or "none"
            return f"link '{name}' is fixed to '{link}' and part of it; the collisions there are: {shapes}"
        for link in model.link_names:
            scoped = f"{model.name}{SCOPE}{link}"
            known += [link, scoped]
            for collision in model.collisions(link):
                known += [collision, f"{scoped}{SCOPE}{collision}"]
    return f"there is no model, link or collision '{name}'{did_you_mean(name, known)}"


def contact_pairs(world: World, wanted: set[Collision] | None) -> list[ContactPair]:
    """Returns what touched in the last physics step, in the engine's order.

    Args:
        world: whose contacts.
        wanted: only pairs with one of these, which comes first in them; None: all.
    """
    models = {id(model.body): model for model in world.models.values()}
    pairs: dict[tuple[Collision, Collision], ContactPair] = {}
    for contact in world.engine.contacts():
        point, sign = contact.point, 1.0
        model, other = models[id(contact.first.body)], models[id(contact.second.body)]
        first = _collision(model, contact.first, point)
        second = _collision(other, contact.second, point)
        if wanted is not None and first not in wanted:
            if second not in wanted:
                continue
            model, first, second, sign = other, second, first, -1.0
        pair = pairs.get((first, second))
        if pair is None:
            pair = pairs[first, second] = ContactPair(SCOPE.join(first), SCOPE.join(second))
        force = scale(add(contact.force, contact.friction), sign)
        pair.points.append(point)
        pair.normals.append(scale(contact.normal, sign))
        pair.wrenches.append((force, cross(subtract(point, _centre(model, first[1])), force)))
        pair.depths.append(contact.depth)
    return list(pairs.values())


def _collision(model: Model, side: Side, point: Vector) -> Collision:
    """The one that touches. Of several that it may be, that with the nearest surface."""
    name = side.collisions[0]
    if len(side.collisions) > 1:
        pose, shapes = model.link_state(side.link)[0], model.collisions(side.link)
        name = min(side.collisions, key=lambda each: distance(shapes[each], pose, point))
    return model.name, side.link, name


def _centre(model: Model, link: str) -> Vector:
    """The centre of mass [m] of a link in the world; the origin of one that has no mass."""
    inertia, pose = model.description.links[link].inertia, model.link_state(link)[0]
    return pose.position if inertia is None else pose.compose(inertia.com).position
