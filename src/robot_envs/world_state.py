"""States of a world: joints, links, models and contacts by name; and initial states."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, NamedTuple, TypeVar

from file_access.text import did_you_mean
from robot_sim.physics.engine import seen_from
from robot_sim.physics.pose import ZERO, Pose, Vector
from robot_sim.sensors.sensor_reading import Reading
from robot_sim.state import ContactPair, LinkQuery, StateQuery

__all__ = ["Command", "Commands", "ContactPair", "InitialState", "JointState", "LinkQuery", "Motion", "Pose",
           "Push", "Reading", "StateQuery", "Twist", "WorldState"]  # fmt: skip

Entry = TypeVar("Entry")
Command = float | Sequence[float]
"""For one controller [m, rad, m/s, rad/s, N, N m]: a number, or for a group one for each of its joints."""
# Where a policy is deployed, the name of a vehicle's odometry among its sensors
ODOMETRY = "odometry"
Commands = Mapping[str, Command]
"""By the controller's name; "/namespace/name" in a world with several robots."""


class JointState(NamedTuple):
    """Position [rad, m], velocity [rad/s, m/s] and effort [N m, N] of a joint."""

    position: float
    velocity: float
    effort: float


class Twist(NamedTuple):
    """Linear [m/s] and angular [rad/s] velocity."""

    linear: Vector = ZERO
    angular: Vector = ZERO


class Motion(NamedTuple):
    """The pose of a link or model, and its velocity."""

    pose: Pose
    twist: Twist = Twist()

    @classmethod
    def of(cls, pose: Pose, twist: tuple[Vector, Vector]) -> "Motion":
        """Returns a motion with a velocity that is a pair of vectors."""
        return cls(pose, Twist(*twist))

    def seen_from(self, frame: "Motion") -> "Motion":
        """Returns the same, seen from the frame of another; its rotation adds nothing to velocities."""
        return Motion.of(*seen_from(self, frame))


class UnknownEntry(KeyError):
    """A name that a state doesn't have; the text has the nearest ones."""

    def __str__(self) -> str:
        return str(self.args[0])


class _Entries(dict[str, Entry]):
    """A part of a state, by name."""

    __slots__ = ()
    what: ClassVar[str]
    hint: ClassVar[str] = ""

    def __missing__(self, name: str) -> Entry:
        near = did_you_mean(name, self) or f"; there are: {', '.join(self) or 'none'}"
        raise UnknownEntry(f"the state has no {self.what} '{name}'{near}{self.hint}")


class Joints(_Entries[JointState]):
    """Joints by name."""

    __slots__ = ()
    what = "joint"


class Links(_Entries[Motion]):
    """Links by their names in the query."""

    __slots__ = ()
    what, hint = "link", "; the task's query names those that a state has"


class Models(_Entries[Motion]):
    """Models by name."""

    __slots__ = ()
    what, hint = "model", "; the task's query names those that a state has"


class Sensors(_Entries[Reading]):
    """Sensors by their names in the query."""

    __slots__ = ()
    what, hint = "sensor", "; the task's query names those that a state has"


class WorldState(NamedTuple):
    """The world after a reset or a control period: bit-identical in-process and over ROS in lock-step.

    | attribute | what it has |
    |---|---|
    | `time` | simulated time since the reset [s] |
    | `joints` | joints with a transmission, by name; "model::joint" in a world with several robots |
    | `commands` | what each commanded controller was sent last, by name: a number, or a tuple for a group |
    | `links` | links that the task's query names, by that name, each in the frame asked for |
    | `models` | models that the query names, in the world frame |
    | `contacts` | contacts of the last physics step that the query asks for; none right after a reset |
    | `sensors` | the last `Reading` of each sensor that the query names, by that name |
    """

    time: float
    joints: Mapping[str, JointState]
    commands: Mapping[str, Any] = {}
    links: Mapping[str, Motion] = Links()
    models: Mapping[str, Motion] = Models()
    contacts: Sequence[ContactPair] = ()
    sensors: Mapping[str, Reading] = Sensors()


class Push(NamedTuple):
    """A force [N], in the world's axes, at a link's centre of mass."""

    link: str  # "model::link"
    force: Vector
    start: float  # [s] of the episode
    duration: float  # [s]


@dataclass(frozen=True)
class InitialState:
    """The state in which an episode begins; whatever isn't named is as it was spawned.

    Args:
        joints: Positions [rad, m], or positions and velocities [rad/s, m/s], by the joint's name; others are
            at 0. A position beyond a stop means at the stop.
        models: Poses or motions of models in the world, by name; others are where they were spawned.
        commands: What controllers hold until the first action, by name; by default position controllers hold
            their joints' positions, and others 0.
        pushes: Forces that act on links during the episode.
    """

    joints: Mapping[str, float | tuple[float, float]] = field(default_factory=dict)
    models: Mapping[str, Motion | Pose] = field(default_factory=dict)
    commands: Commands = field(default_factory=dict)
    pushes: Sequence[Push] = ()


ONLY_REWARDED = "; what only the reward needs belongs into the task's reward_query"


def both(first: StateQuery, second: StateQuery) -> StateQuery:
    """Returns a query for what either of two asks for."""

    def merged(name: str) -> Any:
        one, other = getattr(first, name), getattr(second, name)
        return one or other if isinstance(one, bool) else tuple(dict.fromkeys([*one, *other]))

    return StateQuery(**{each.name: merged(each.name) for each in fields(StateQuery)})


def part_of(state: WorldState, query: StateQuery) -> WorldState:
    """Returns a state with what a query names alone; contacts stay all, or none."""
    links = Links((name, state.links[name]) for name in link_keys(query))
    named = Models((name, state.models[name]) for name in query.models)
    contacts = state.contacts if query.all_contacts or query.contacts_of else ()
    models = state.models if query.all_models else named
    sensors = Sensors((name, state.sensors[name]) for name in query.sensors)
    return state._replace(links=links, models=models, contacts=contacts, sensors=sensors)


def link_keys(query: StateQuery) -> list[str]:
    """Returns a query's names in `WorldState.links`; raises ValueError for one that is there twice."""
    names = [each.link for each in query.links]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(
                f"links names '{name}' twice; ask for it once, and for other frames see Motion.seen_from"
            )
    return names
