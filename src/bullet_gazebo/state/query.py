"""What a client wants to know of a world after a step, beside its joints; names are resolved once."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from bullet_gazebo.physics.engine import Twist
from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import Pose, add, cross, rotate
from bullet_gazebo.physics.world import World, seen_from
from bullet_gazebo.state.contacts import Collision, ContactPair, contact_pairs, find_collisions
from bullet_gazebo.state.names import find_link, find_model

State = tuple[Pose, Twist]


class LinkQuery(NamedTuple):
    """A link, and the link in whose frame its state is wanted: of the world if that is "" or "world".

    Names are plain, or model::link. A link that a fixed joint has made part of another one can be named, too.
    """

    link: str
    frame: str = ""


@dataclass(frozen=True)
class StateQuery:
    """What is wanted. What isn't, costs nothing.

    Args:
        models: names of models whose states are wanted.
        all_models: of all of them, instead.
        links: whose states are wanted.
        contacts_of: names of models, links or collisions, plain or scoped: all that touches them is wanted.
        all_contacts: all that touches anything, instead.
    """

    models: tuple[str, ...] = ()
    all_models: bool = False
    links: tuple[LinkQuery, ...] = ()
    contacts_of: tuple[str, ...] = ()
    all_contacts: bool = False


NOTHING = StateQuery()


class StateAnswer(NamedTuple):
    """Poses [m] and twists [m/s, rad/s] of models by name and of links in the query's order, and contacts.

    A model's are as get_model_state tells them, a link's as get_link_state.
    """

    models: dict[str, State]
    links: list[State]
    contacts: list[ContactPair]


class StateReader:
    """Answers a query, again and again."""

    def __init__(self, world: World, query: StateQuery) -> None:
        """
        Raises:
            UnknownName: if the world has nothing of a name, or several things.
        """
        self.query = query
        self._world = world
        self._resolve()

    @property
    def is_stale(self) -> bool:
        """Whether models have come or gone since the names were looked up."""
        return self._version != self._world.version

    def read(self, stepped: bool = True) -> StateAnswer:
        """Reads the world.

        Args:
            stepped: whether what touches is that of the present state. After a reset or a placing
                it isn't: that only a step finds out, and there are no contacts before.

        Raises:
            UnknownName: if something of the query has gone.
        """
        if self.is_stale:
            self._resolve()
        contacts = contact_pairs(self._world, self._wanted) if self._touch and stepped else []
        return StateAnswer(
            {model.name: model.state() for model in self._models},
            [read() for read in self._links],
            contacts,
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
            self._wanted = find_collisions(world, query.contacts_of)

    def _link(self, query: LinkQuery) -> Callable[[], State]:
        read = _reader(*find_link(self._world, query.link))
        if self._world.is_world_frame(query.frame):
            return read
        frame = _reader(*find_link(self._world, query.frame))
        return lambda: seen_from(read(), frame())


def _reader(model: Model, link: str) -> Callable[[], State]:
    """Returns what reads a link's state in the world."""
    if link in model.description.links:
        return lambda: model.link_state(link)
    whole, place = model.description.lumped[link]

    def read() -> State:
        pose, (linear, angular) = model.link_state(whole)
        arm = rotate(pose.orientation, place.position)
        return pose.compose(place), (add(linear, cross(angular, arm)), angular)

    return read
