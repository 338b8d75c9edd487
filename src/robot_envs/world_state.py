"""What a task may see of the world beside its robot's `State`: joints, links, models and contacts by name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from bullet_gazebo.physics.engine import Twist
from bullet_gazebo.physics.model import AT_REST
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import seen_from
from bullet_gazebo.state.contacts import ContactPair
from bullet_gazebo.state.query import LinkQuery, StateQuery

__all__ = ["ContactPair", "JointState", "LinkQuery", "Motion", "Pose", "StateQuery", "WorldState"]


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


@dataclass(frozen=True)
class WorldState:
    """The world after a reset or a control period: the same numbers in-process and over ROS in lock-step.

    | attribute | what it tells |
    |---|---|
    | `time` | simulated time since the reset [s] |
    | `joints` | those of the robot that have a transmission, by plain name |
    | `links` | those that the query names, by the name that it gives them; each in the frame asked for |
    | `models` | those that the query names, in the world |
    | `contacts` | of the last physics step, as the query names them; none right after a reset |
    """

    time: float
    joints: Mapping[str, JointState]
    links: Mapping[str, Motion]
    models: Mapping[str, Motion]
    contacts: Sequence[ContactPair]


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
