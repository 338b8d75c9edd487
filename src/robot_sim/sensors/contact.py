"""Contact sensors: what the collisions of a link touch (docs/contract/sensors.md 5)."""

import logging
from typing import ClassVar

from robot_sim.constants import NANOSECONDS
from robot_sim.physics.lumping import LUMPED
from robot_sim.sensors.sensing import Field, Measurement, Mount, sensor_of
from robot_sim.state import ContactPair, contact_pairs

logger = logging.getLogger(f"rosout.{__name__}")


class ContactSensor(Measurement):
    """A sensor of the contacts of `<contact>`'s collisions."""

    kinds = ("contact",)
    non_persistent = ("_collisions",)
    fields: ClassVar = {"contacts": Field("what its collisions touched in the last step")}

    def __init__(self, mount: Mount) -> None:
        super().__init__(mount)
        sensor = sensor_of(mount, self.kinds)
        self.rate = sensor.rate
        names = [(each.text or "").strip() for each in sensor.element.findall("contact/collision")]
        model, link = mount.model, sensor.link
        found = [collision_named(name, link, list(model.collisions(link))) for name in names]
        for name, taken in zip(names, found, strict=True):
            if taken is None:
                logger.warning("Sensor '%s': link '%s' has no collision '%s'", sensor.name, link, name)
            elif taken != name:
                logger.info("Sensor '%s': collision '%s' is '%s' here", sensor.name, name, taken)
        self._collisions = {(model.name, link, each) for each in found if each is not None}

    def is_stale(self, now: int) -> bool:
        """Returns whether a service has moved the model since the last step: contacts are unknown."""
        step = round(self.mount.sim.world.time_step * NANOSECONDS)
        return now - self.mount.sensing.schedule.last_move(self.mount.model).at <= step

    def measure(self, now: int) -> list[ContactPair]:
        """Returns the collisions' contacts in the last step."""
        if self.is_stale(now) or not self._collisions:
            return []
        return contact_pairs(self.mount.sim.world, self._collisions)

    def values(self, now: int) -> dict[str, list[ContactPair]]:
        return {"contacts": self.measure(now)}


def collision_named(name: str, link: str, collisions: list[str]) -> str | None:
    """Returns the collision that is meant, whichever way a lumped link's is written."""
    child = name.removeprefix(f"{link}_collision_")
    spellings = (name, f"{link}{LUMPED}{name}", f"{link}{LUMPED}{child}_collision")
    exact = [each for each in spellings if each in collisions]
    # Lumping numbers all but the first collision of a link.
    numbered = [
        each
        for spelling in spellings
        for each in collisions
        if each.startswith(f"{spelling}_") and each.removeprefix(f"{spelling}_").isdigit()
    ]
    return next(iter([*exact, *numbered]), None)


SENSORS = (ContactSensor,)
