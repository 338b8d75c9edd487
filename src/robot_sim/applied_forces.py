"""Efforts and wrenches that clients apply for some time (docs/contract/gazebo.md 2.18 and 2.19)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from robot_sim.physics.model import Model
from robot_sim.physics.pose import ZERO, Pose, Vector, add, cross, rotate

Wrench = tuple[Vector, Vector]
"""Force [N] and torque [N m]."""


@dataclass(frozen=True)
class ActingTime:
    """When an effort or wrench acts, in simulated time [ns]; a negative duration is forever."""

    start: int
    duration: int

    def covers(self, now: int) -> bool:
        return now >= self.start and (self.duration < 0 or now <= self.start + self.duration)

    def is_over(self, now: int) -> bool:
        return self.duration >= 0 and now > self.start + self.duration


@dataclass(frozen=True)
class AppliedEffort:
    """An effort [N m, N] on the joint of that plain name."""

    model: Model
    joint: str
    effort: float
    interval: ActingTime


@dataclass(frozen=True)
class AppliedWrench:
    """A wrench on the link of that plain name, at its centre of mass, in world axes."""

    model: Model
    link: str
    wrench: Wrench
    interval: ActingTime


class AppliedForces:
    """The efforts and wrenches that act now or later."""

    def __init__(self) -> None:
        self.efforts: list[AppliedEffort] = []
        self.wrenches: list[AppliedWrench] = []

    def clear_efforts(self, joint: str) -> None:
        """Drops all efforts on joints of that plain name, whatever their model."""
        self.efforts = [each for each in self.efforts if each.joint != joint]

    def clear_wrenches(self, body: str) -> None:
        """Drops all wrenches on the link of that scoped name."""
        self.wrenches = [each for each in self.wrenches if f"{each.model.name}::{each.link}" != body]

    def forget(self, model: Model) -> None:
        """Drops a model's efforts and wrenches; as in Gazebo, other models' joints of the same name too."""
        names = set(model.all_joints)
        self.wrenches = [each for each in self.wrenches if each.model is not model]
        self.efforts = [each for each in self.efforts if each.joint not in names]

    def state_dict(self) -> dict[str, Any]:
        """Returns what acts, each with its model's name."""
        return {
            "efforts": [(e.model.name, e.joint, e.effort, e.interval) for e in self.efforts],
            "wrenches": [(w.model.name, w.link, w.wrench, w.interval) for w in self.wrenches],
        }

    def load_state_dict(self, state: Mapping[str, Any], models: Mapping[str, Model]) -> None:
        """Loads what `state_dict` returned, in a world with these models."""
        self.efforts = [AppliedEffort(models[name], *each) for name, *each in state["efforts"]]
        self.wrenches = [AppliedWrench(models[name], *each) for name, *each in state["wrenches"]]

    def wrench_on(self, model: Model, link: str, now: int) -> Wrench:
        """Returns what acts on a link in the step that ends at `now` [ns]."""
        acting = [
            each.wrench
            for each in self.wrenches
            if each.model is model and each.link == link and each.interval.covers(now)
        ]
        return acting[-1] if acting else (ZERO, ZERO)

    def effort_on(self, model: Model, joint: str, now: int) -> float:
        """Returns the effort [N m, N] on a movable joint in the step that ends at `now` [ns]."""
        return math.fsum(
            _truncated(each)
            for each in self.efforts
            if each.model is model and each.joint == joint and each.interval.covers(now)
        )

    def apply(self, now: int) -> None:
        """Applies the forces of the step that ends at `now` [ns], and drops expired ones."""
        # Gazebo sets a body's force and torque: of several wrenches the one queued last counts.
        acting = {(id(w.model), w.link): w for w in self.wrenches if w.interval.covers(now)}
        for each in acting.values():
            each.model.body.add_wrench(each.link, *each.wrench)
        for effort in self.efforts:
            if effort.interval.covers(now) and effort.joint in effort.model.joint_names:
                index = effort.model.joint_index(effort.joint)
                effort.model.body.add_effort(index, _truncated(effort))
        self.wrenches = [each for each in self.wrenches if not each.interval.is_over(now)]
        self.efforts = [each for each in self.efforts if not each.interval.is_over(now)]


def _truncated(applied: AppliedEffort) -> float:
    """Returns the effort within the joint's limit; 0 if it would exceed the velocity limit further."""
    joint = applied.model.description.joints[applied.joint]
    _, speed = applied.model.joint_state(applied.joint)
    if 0.0 <= joint.velocity < abs(speed) and speed * applied.effort > 0.0:
        return 0.0
    return applied.effort if joint.effort < 0.0 else math.copysign(
        min(abs(applied.effort), joint.effort), applied.effort
    )  # fmt: skip


def in_world(wrench: Wrench, point: Vector, body: Pose, frame: Pose | None) -> Wrench:
    """Returns the wrench that acts when a client applies `wrench` at `point` [m] of `frame`.

    A frame of None is the world: `point` is then an offset from the body's centre of mass. Otherwise Gazebo
    turns the wrench into the body's axes and applies it as if those were the world's; so do we.
    """
    force, torque = wrench
    torque = add(torque, cross(point, force))
    if frame is None:
        return force, torque
    seen = frame.relative_to(body)
    force = rotate(seen.orientation, force)
    return force, add(rotate(seen.orientation, torque), cross(seen.position, force))
