"""State queries beyond joints: models, links in any frame, contacts.

`step_world` and in-process environments share this code. Names are looked up once for each query; one that
refers to nothing, or to several entities, raises UnknownName.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import hypot
from typing import NamedTuple

import numpy as np

from file_access.text import did_you_mean
from robot_sim.physics.description import Shape
from robot_sim.physics.engine import Side, Twist, seen_from
from robot_sim.physics.lumping import WORLD
from robot_sim.physics.model import Model
from robot_sim.physics.pose import ZERO, Pose, Vector, add, conjugate, cross, rotate, scale, subtract
from robot_sim.physics.world import World

SCOPE = "::"
Wrench = tuple[Vector, Vector]
"""Force [N] and torque [N m], in world axes."""
Collision = tuple[str, str, str]
"""Names of a model, its link, and the link's collision."""
State = tuple[Pose, Twist]


def distance(shape: Shape, link: Pose, point: Vector) -> float:
    """Returns the distance [m] of a point in the world from a shape's surface, on either side of it.

    A mesh counts as its bounding box. `link` is the pose of the shape's link.
    """
    frame = link.compose(shape.pose)
    x, y, z = rotate(conjugate(frame.orientation), subtract(point, frame.position))
    if shape.kind == "plane":
        return abs(z)
    if shape.kind == "sphere":
        return abs(hypot(x, y, z) - shape.size[0])
    if shape.kind == "cylinder":
        radius, length = shape.size
        return abs(_beyond(hypot(x, y) - radius, abs(z) - length / 2.0))
    low, high = _box(shape)
    beyond = (max(a - p, p - b) for p, a, b in zip((x, y, z), low, high, strict=True))
    return abs(_beyond(*beyond))


def _box(shape: Shape) -> tuple[Vector, Vector]:
    """Returns opposite corners [m] of a box, or of the bounding box of a mesh."""
    if shape.kind == "box":
        x, y, z = (length / 2.0 for length in shape.size)
        return (-x, -y, -z), (x, y, z)
    assert shape.solid is not None  # collisions are read
    corners = np.array(shape.size) * [shape.solid.vertices.min(0), shape.solid.vertices.max(0)]
    (ax, ay, az), (bx, by, bz) = np.sort(corners, axis=0).tolist()
    return (ax, ay, az), (bx, by, bz)


def _beyond(*excess: float) -> float:
    """Returns the signed distance [m] of a point from a body, from those in directions at right angles."""
    outside = hypot(*(max(each, 0.0) for each in excess))
    return outside + min(max(excess), 0.0)


class UnknownName(ValueError):
    """No entity has a name, or several have; the text says what to write instead."""


def find_model(world: World, name: str) -> Model:
    """Returns the model of that name."""
    if name not in world.models:
        raise UnknownName(f"there is no model '{name}'{did_you_mean(name, world.models)}")
    return world.models[name]


def find_link(world: World, name: str) -> tuple[Model, str]:
    """Returns model and plain name of a link, also of one that was lumped into another one.

    `name` is plain, or model::link where several models have such a link.
    """
    scope, _, plain = name.rpartition(SCOPE)
    if plain == WORLD:
        models: list[Model] = []
    elif scope:
        models = [world.models[scope]] if scope in world.models else []
    else:
        models = list(world.models.values())
    found = [m for m in models if plain in m.description.links or plain in m.description.lumped]
    if not found:
        raise UnknownName(f"there is no link '{name}'{did_you_mean(name, link_names(world))}")
    if len(found) > 1:
        raise UnknownName(f"several models have a link '{name}'; write model::{name}")
    return found[0], plain


def link_names(world: World) -> list[str]:
    """Returns all names that `find_link` accepts, plain and scoped."""
    names = []
    for model in world.models.values():
        description = model.description
        for link in (*description.links, *description.lumped):
            if link != WORLD:
                names += [link, f"{model.name}{SCOPE}{link}"]
    return names


@dataclass
class ContactPair:
    """Two collisions that touched in the last physics step, each as model::link::collision.

    The lists have an entry for each point [m]. Unit normals point towards the first collision. Wrenches act
    on its link, with torques about its centre of mass. Depths [m] are those of the overlap. All is in world
    axes.
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


def find_collisions(world: World, name: str) -> set[Collision]:
    """Returns all collisions that the name of a model, link or collision refers to.

    It is plain, or model::link or model::link::collision where several models have such a name.
    """
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
            f"several models have a link or collision '{name}'; write model::link or model::link::collision"
        )
    if not found:
        raise UnknownName(_why_none(world, name))
    return found


def _why_none(world: World, name: str) -> str:
    """Returns why a name refers to no collision."""
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

    Only pairs with one of the `wanted` collisions, which then is the first one; None: all pairs.
    """
    models = {id(model.body): model for model in world.models.values()}
    pairs: dict[tuple[Collision, Collision], ContactPair] = {}
    for contact in world.contacts():
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
    """Returns the collision that touches: of several possible ones, that with the nearest surface."""
    name = side.collisions[0]
    if len(side.collisions) > 1:
        pose, shapes = model.link_state(side.link)[0], model.collisions(side.link)
        name = min(side.collisions, key=lambda each: distance(shapes[each], pose, point))
    return model.name, side.link, name


def _centre(model: Model, link: str) -> Vector:
    """Returns the centre of mass [m] of a link in the world; the origin of a link without mass."""
    inertia, pose = model.description.links[link].inertia, model.link_state(link)[0]
    return pose.position if inertia is None else pose.compose(inertia.com).position


class LinkQuery(NamedTuple):
    """A link, and the link in whose frame its state is expressed; "" and "world" are the world's frame.

    Names are plain, or model::link. Links that were lumped into another one have a state, too.
    """

    link: str
    frame: str = ""


@dataclass(frozen=True)
class StateQuery:
    """A query by names, plain or scoped by models; only its parts are computed."""

    models: tuple[str, ...] = ()  # whose states are wanted
    all_models: bool = False  # instead
    links: tuple[LinkQuery, ...] = ()
    contacts_of: tuple[str, ...] = ()  # models, links or collisions
    all_contacts: bool = False  # instead
    sensors: tuple[str, ...] = ()  # whose last measurements are wanted; `sensor_readers` reads them


NOTHING = StateQuery()


class StateAnswer(NamedTuple):
    """Poses [m] and twists [m/s, rad/s] of models by name and of links in the query's order, and contacts.

    States of models are those of get_model_state, states of links those of get_link_state.
    """

    models: dict[str, State]
    links: list[State]
    contacts: list[ContactPair]


class StateReader:
    """Answers a query, again and again."""

    def __init__(self, world: World, query: StateQuery) -> None:
        self.query = query
        self._world = world
        self._resolve()

    @property
    def is_stale(self) -> bool:
        """Whether models have come or gone since the names were looked up."""
        return self._version != self._world.version

    def read(self, stepped: bool = True) -> StateAnswer:
        """Reads the world; there are no contacts unless it was `stepped` since a reset or a placing."""
        if self.is_stale:
            self._resolve()
        contacts = contact_pairs(self._world, self._wanted) if self._touch and stepped else []
        return StateAnswer(
            {model.name: model.state() for model in self._models}, [read() for read in self._links], contacts
        )

    def _resolve(self) -> None:
        query, world = self.query, self._world
        self._version = world.version
        self._models = [find_model(world, name) for name in query.models]
        if query.all_models:
            self._models = list(world.models.values())
        self._links = [self._link(each) for each in query.links]
        self._touch = query.all_contacts or bool(query.contacts_of)
        self._wanted: set[Collision] | None = None
        if not query.all_contacts:
            found = (find_collisions(world, name) for name in query.contacts_of)
            self._wanted = set().union(*found)

    def _link(self, query: LinkQuery) -> Callable[[], State]:
        read = _reader(*find_link(self._world, query.link))
        if self._world.is_world_frame(query.frame):
            return read
        frame = _reader(*find_link(self._world, query.frame))
        return lambda: seen_from(read(), frame())


def _reader(model: Model, link: str) -> Callable[[], State]:
    """Returns a function that reads a link's state in the world."""
    if link in model.description.links:
        return lambda: model.link_state(link)
    whole, place = model.description.lumped[link]

    def read() -> State:
        pose, (linear, angular) = model.link_state(whole)
        arm = rotate(pose.orientation, place.position)
        return pose.compose(place), (add(linear, cross(angular, arm)), angular)

    return read
