"""Constraints of PyBullet: links that are fixed to each other, and joints that follow others."""

from collections.abc import Sequence
from typing import Any

from bullet_gazebo.physics.description import Mimic
from bullet_gazebo.physics.engine import GEAR, STRONGEST
from bullet_gazebo.physics.engines.quiet_pybullet import pybullet
from bullet_gazebo.physics.pose import Pose

Place = tuple[int, int]
"""PyBullet's numbers of a body and a link of it."""


def weld_of(first: Place, second: Place, pose: Pose) -> Sequence[Any]:
    """Returns what a weld is made of; `pose` is the second centre of mass seen from the first one."""
    return (
        *first, *second, pybullet.JOINT_FIXED, [0, 0, 0],
        pose.position, [0, 0, 0], pose.orientation, [0, 0, 0, 1],
    )  # fmt: skip


def add_weld(client: int, made_of: Sequence[Any]) -> int:
    """Adds what `weld_of` returned; returns the constraint's number."""
    constraint: int = pybullet.createConstraint(*made_of, client)
    pybullet.changeConstraint(constraint, maxForce=STRONGEST, physicsClientId=client)
    return constraint


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
