"""Actors: models that follow a script, whatever acts on them."""

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from robot_sim.physics.engine import Twist
from robot_sim.physics.model import AT_REST, Model
from robot_sim.physics.pose import Pose, Quaternion, add, normalized, scale, subtract

SMALL = 1e-4  # [rad]; an angle that equals its sine, as far as normalizing tells


@dataclass(frozen=True)
class Script:
    """Waypoints of an actor: times from 0 on [s], and poses in the world.

    `delay` [s] passes before each run; `loop` is whether there are more than one.
    """

    points: tuple[tuple[float, Pose], ...]
    delay: float
    loop: bool

    def __call__(self, now: float, before: Pose) -> Pose:
        """Returns where the actor is at `now` [s], if it was at `before` before the first run."""
        period = self.delay + self.points[-1][0]
        if now < self.delay:
            return before
        time = (math.fmod(now, period) if self.loop and period > 0.0 else now) - self.delay
        index = bisect_right(self.points, time, key=lambda point: point[0])
        if not 0 < index < len(self.points):  # it waits where the last run has ended
            return self.points[-1][1]
        (start, pose), (end, following) = self.points[index - 1 : index + 1]
        share = (time - start) / (end - start)
        way = scale(subtract(following.position, pose.position), share)
        turned = slerp(pose.orientation, following.orientation, share)
        return Pose(add(pose.position, way), turned)


def slerp(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    """Returns the rotation that has done a share of the shorter way from `a` to `b`, at a constant rate."""
    cosine = sum(one * other for one, other in zip(a, b, strict=True))
    angle, parts = math.acos(min(1.0, abs(cosine))), (1.0 - share, share)
    first, second = parts if angle < SMALL else (math.sin(part * angle) for part in parts)
    second = math.copysign(second, cosine)
    x, y, z, w = (first * one + second * other for one, other in zip(a, b, strict=True))
    return normalized((x, y, z, w))


class Actor(Model):
    """A model whose only link is where its script wants it at the time of `clock` [s], without velocity.

    Its body touches nothing, and stays: so it costs ticks nothing, and whoever looks sees it where it is now.
    """

    def __init__(self, clock: Callable[[], float], *given: Any) -> None:
        super().__init__(*given)
        self._clock = clock

    def link_state(self, name: str) -> tuple[Pose, Twist]:
        script = self.description.script
        return (script(self._clock(), self.placed) if script else self.placed), AT_REST

    def poses_by_link(self) -> dict[str, Pose]:
        return {name: self.link_state(name)[0] for name in self.link_names}
