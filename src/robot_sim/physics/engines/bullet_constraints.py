"""Constraints of PyBullet: links that are fixed to each other, and joints that follow others."""

from collections.abc import Mapping, Sequence
from typing import Any

from robot_sim.physics.description import BALL, Link, Mimic
from robot_sim.physics.engine import GEAR, STRONGEST
from robot_sim.physics.engines.quiet_pybullet import pybullet
from robot_sim.physics.pose import Pose

IN_PLACE = Pose()
Place = tuple[int, int]
"""PyBullet's numbers of a body and a link of it."""


def weld_of(
    first: Place, second: Place, pose: Pose, own: Pose = IN_PLACE, kind: int = pybullet.JOINT_FIXED
) -> Sequence[Any]:
    """Returns what a weld, or a constraint of another kind, is made of.

    It keeps the frame at `pose`, seen from the first centre of mass, at `own`, seen from the second one.
    """
    return (
        *first, *second, kind, [0, 0, 0],
        pose.position, own.position, pose.orientation, own.orientation,
    )  # fmt: skip


def add_weld(client: int, made_of: Sequence[Any]) -> int:
    """Adds what `weld_of` returned; returns the constraint's number."""
    constraint: int = pybullet.createConstraint(*made_of, client)
    pybullet.changeConstraint(constraint, maxForce=STRONGEST, physicsClientId=client)
    return constraint


def close_loop(
    client: int, body: int, helper: Link, links: Mapping[str, int], offsets: Mapping[str, Pose]
) -> None:
    """Joins a helper link with the link that it is part of, where it is with all joints at zero.

    `links` are PyBullet's, and `offsets` their frames in the file, seen from PyBullet's, where they differ.
    """
    # In the frames that both links have in the file.
    joint = offsets.get(helper.name, Pose()).inverse()
    places, frames = [], []
    for name in (helper.part_of, helper.name):
        places.append((body, links[name]))
        centre = Pose(*pybullet.getDynamicsInfo(*places[-1], client)[3:5])
        frames.append(offsets.get(name, Pose()).compose(joint).relative_to(centre))
    kind = pybullet.JOINT_POINT2POINT if helper.closing == BALL else pybullet.JOINT_FIXED
    add_weld(client, weld_of(places[0], places[1], frames[0], frames[1], kind))


def add_gear(client: int, follower: Place, driver: Place, mimic: Mimic) -> int:
    """Makes a joint follow another one; returns the constraint's number."""
    gear: int = pybullet.createConstraint(
        *follower, *driver, pybullet.JOINT_GEAR, [1, 0, 0], [0, 0, 0], [0, 0, 0],
        physicsClientId=client,
    )  # fmt: skip
    pybullet.changeConstraint(
        gear, gearRatio=-mimic.multiplier, relativePositionTarget=mimic.offset, erp=GEAR,
        physicsClientId=client,
    )  # fmt: skip
    return gear
