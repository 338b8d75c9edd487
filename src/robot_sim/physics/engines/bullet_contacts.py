"""Compliance of PyBullet's contacts, and the speed at which they separate what overlaps.

A contact is a spring and a damper, integrated implicitly. The spring yields by tenths of a millimetre under
the weight of its model, so that all supports that touch carry. Hard contacts would give the whole load to
whatever stands a few micrometres lower. The damper is stronger than critical: nothing rebounds.

Its relaxation time alone bounds how fast an overlap ends, to the overlap / RELAXATION. Where a file allows
less (`<max_vel>`), as it does where a model has been placed into another one, the contacts of those links
become hard, with that speed as their target, until the overlap is shallow.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from robot_sim.physics.description import ModelDescription
from robot_sim.physics.engines.quiet_pybullet import pybullet

RELAXATION = 0.02  # [s]
STIFFNESS = 1e6  # [N/m] of the contact points of a light model
STIFFNESS_OF_A_KILOGRAM = 6e4  # [N/m]; a weight on a single point sinks 0.16 mm
HARD = 1e9  # [N s/m] of contacts at a given speed: much more than mass / time step
# Which links collide: bits of a link's group, and of the groups that it meets; one that meets the other
# is enough. The third is for links of static models, which kinematic ones don't meet; the others are
# PyBullet's defaults.
DYNAMIC, STATIC, FIXED, EVERYTHING = 1, 2, 4, -1
SHALLOW = 0.0002  # [m]; at the file format's usual 0.01 m/s, what ends within RELAXATION anyway

LinkIndex = tuple[int, int]
"""PyBullet's numbers of a body and a link of it."""


def groups_of(model: ModelDescription, link: str, fixed: bool) -> tuple[int, int]:
    """Returns the groups that a link is in, and meets; `fixed` is the base of a model that can't move."""
    if fixed:
        return STATIC, EVERYTHING ^ STATIC
    if model.links[link].kinematic:
        return STATIC, EVERYTHING ^ STATIC ^ FIXED
    return (FIXED, EVERYTHING ^ STATIC) if model.static else (DYNAMIC, EVERYTHING)


class Separation:
    """How contacts of a PyBullet world push links apart.

    `placed` is set by whatever may have put bodies into each other. What follows depends on their poses
    alone, not on what came before.
    """

    def __init__(self, client: int) -> None:
        self.placed = False
        self.fastest = 0.0  # [m/s] for all contacts
        self._client = client
        self._links: dict[LinkIndex, tuple[float, float]] = {}  # stiffness [N/m], max_vel [m/s]
        self._eased: set[LinkIndex] = set()

    def add(self, body: int, model: ModelDescription, links: Mapping[str, int]) -> None:
        """Makes the contacts of a body compliant, but those of static and kinematic links.

        `body` and `links` are PyBullet's numbers.
        """
        # Python 3.12 sums floats up in another way than 3.11; their exact sum has the same bits in both.
        inertias = [link.inertia for link in model.links.values() if not link.kinematic]
        mass = math.fsum(inertia.mass for inertia in inertias if inertia)
        stiffness = 0.0 if model.static else max(STIFFNESS, STIFFNESS_OF_A_KILOGRAM * mass)
        for name, index in links.items():
            link = model.links[name]
            own = 0.0 if link.kinematic else stiffness
            self._links[body, index] = own, link.max_vel
            if own:
                self._set((body, index), own, own * RELAXATION)
        self.placed = True

    def remove(self, body: int) -> None:
        """Forgets a body that is removed."""
        self._links = {link: each for link, each in self._links.items() if link[0] != body}
        self._eased = {link for link in self._eased if link[0] != body}

    def ease(self, time_step: float) -> None:
        """Bounds the speeds of the next step; called while `placed`."""
        pybullet.performCollisionDetection(self._client)
        contacts = pybullet.getContactPoints(physicsClientId=self._client)
        # Shares of the overlap to end in a step, of links on static ones, and of those that push each other.
        alone: dict[LinkIndex, float] = {}
        mutual: dict[LinkIndex, float] = {}
        for contact in contacts:
            if contact[8] < -SHALLOW:
                self._ease_pair(contact, time_step, alone, mutual)
        for link in self._eased - alone.keys() - mutual.keys():
            stiffness, _ = self._links[link]
            self._set(link, stiffness, stiffness * RELAXATION)
        # PyBullet adds up the reciprocals of two links' stiffnesses, and their dampings. Static ones have
        # none, so two links that both move share theirs.
        for link, share in mutual.items():
            self._set(link, 2.0 * share * HARD / time_step, 0.5 * HARD)
        for link, share in alone.items():
            self._set(link, share * HARD / time_step, HARD)
        self._eased = set(alone) | set(mutual)
        self.placed = any((*alone.values(), *mutual.values()))

    def _ease_pair(
        self, contact: Sequence[Any], time_step: float, alone: dict[LinkIndex, float],
        mutual: dict[LinkIndex, float],
    ) -> None:  # fmt: skip
        pair = (contact[1], contact[3]), (contact[2], contact[4])
        speed = min(self.fastest, *(self._links[link][1] for link in pair))
        share = min(speed * time_step / -contact[8], time_step / (time_step + RELAXATION))
        moving = [link for link in pair if self._links[link][0]]
        shares = mutual if len(moving) == 2 else alone
        for link in moving:
            shares[link] = min(share, shares.get(link, 1.0))

    def _set(self, link: LinkIndex, stiffness: float, damping: float) -> None:
        pybullet.changeDynamics(
            *link, contactStiffness=stiffness, contactDamping=damping, physicsClientId=self._client
        )
