"""What a task sees: joints, links, models and contacts by name; and where it has an episode begin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, TypeVar

from bullet_gazebo.physics.engine import Twist
from bullet_gazebo.physics.model import AT_REST
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import seen_from
from bullet_gazebo.state import ContactPair, LinkQuery, StateQuery, did_you_mean

__all__ = [
    "Command",
    "Commands",
    "ContactPair",
    "InitialState",
    "JointState",
    "LinkQuery",
    "Motion",
    "Pose",
    "StateQuery",
    "WorldState",
]

Entry = TypeVar("Entry")
Command = float | Sequence[float]
"""Of one controller [m, rad, m/s, rad/s, N, N m]: a number, or for a group one for each joint of its list."""
Commands = Mapping[str, Command]
"""By the controller's name; "/namespace/name" where a world has several robots."""


class JointState(NamedTuple):
    """Position [rad, m], velocity [rad/s, m/s] and effort [N m, N] of a joint."""

    position: float
    velocity: float
    effort: float


class Motion(NamedTuple):
    """Where a link or a model is, and its linear [m/s] and angular [rad/s] velocity."""

    pose: Pose
    twist: Twist = AT_REST

    def seen_from(self, frame: "Motion") -> "Motion":
        """The same in the frame of something else, both being told in the same frame.

        Velocities are differences, in the other's axes, without what its turning adds.
        """
        return Motion(*seen_from(self, frame))


class UnknownEntry(KeyError):
    """A name that a state doesn't have; the text says which are near."""

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
    """Links by the names that a query has for them."""

    __slots__ = ()
    what, hint = "link", "; the task's query names those that it tells"


class Models(_Entries[Motion]):
    """Models by name."""

    __slots__ = ()
    what, hint = "model", "; the task's query names those that it tells"


class WorldState(NamedTuple):
    """The world after a reset or a control period: the same numbers in-process and over ROS in lock-step.

    | attribute | what it tells |
    |---|---|
    | `time` | simulated time since the reset [s] |
    | `joints` | those with a transmission, by name; as "model::joint" where a world has several robots |
    | `commands` | what each commanded controller was sent last, by name: a number, or a tuple for a group |
    | `links` | those that the task's query names, by that name; each in the frame asked for |
    | `models` | those that the query names, in the world |
    | `contacts` | of the last physics step, as the query names them; none right after a reset |
    """

    time: float
    joints: Mapping[str, JointState]
    commands: Mapping[str, Any] = {}
    links: Mapping[str, Motion] = Links()
    models: Mapping[str, Motion] = Models()
    contacts: Sequence[ContactPair] = ()


@dataclass(frozen=True)
class InitialState:
    """Where an episode begins; what isn't named is as the robot was spawned.

    Args:
        joints: positions [rad, m], or positions and velocities [rad/s, m/s], by the joint's name; the
            others stand at 0. Beyond a stop means at it.
        models: where models are put, in the world, by name; the others stand where they were spawned.
        commands: what controllers hold until the first action, by name; by default position controllers
            where their joints stand, and others 0.
    """

    joints: Mapping[str, float | tuple[float, float]] = field(default_factory=dict)
    models: Mapping[str, Motion | Pose] = field(default_factory=dict)
    commands: Commands = field(default_factory=dict)


def link_keys(query: StateQuery) -> list[str]:
    """The names under which `WorldState.links` has what a query asks for.

    Raises:
        ValueError: if one is there twice.
    """
    names = [each.link for each in query.links]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(
                f"links names '{name}' twice; ask for it once, and for other frames see Motion.seen_from"
            )
    return names
