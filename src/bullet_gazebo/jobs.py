"""Efforts and wrenches that clients apply for a time (docs/contract/gazebo.md 2.18 and 2.19)."""

import math
from dataclasses import dataclass

from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import Pose, Vector, add, cross, rotate

Wrench = tuple[Vector, Vector]
"""Force [N] and torque [N m]."""


@dataclass(frozen=True)
class Span:
    """When a job acts, in simulated time [ns]; a negative duration is for ever."""

    start: int
    duration: int

    def covers(self, now: int) -> bool:
        return now >= self.start and (self.duration < 0 or now <= self.start + self.duration)

    def is_over(self, now: int) -> bool:
        return self.duration >= 0 and now > self.start + self.duration


@dataclass(frozen=True)
class EffortJob:
    """An effort [N m, N] on the joint of that plain name."""

    model: Model
    joint: str
    effort: float
    span: Span


@dataclass(frozen=True)
class WrenchJob:
    """A wrench on the link of that plain name, at its centre of mass, in world axes."""

    model: Model
    link: str
    wrench: Wrench
    span: Span


class Jobs:
    """What is to push, and when. The simulator looks once a tick whether there is anything at all."""

    def __init__(self) -> None:
        self.efforts: list[EffortJob] = []
        self.wrenches: list[WrenchJob] = []

    def add_effort(self, job: EffortJob) -> None:
        self.efforts.append(job)

    def add_wrench(self, job: WrenchJob) -> None:
        self.wrenches.append(job)

    def clear_efforts(self, joint: str) -> None:
        """Drops all jobs on joints of that plain name, whatever their model."""
        self.efforts = [job for job in self.efforts if job.joint != joint]

    def clear_wrenches(self, body: str) -> None:
        """Drops all jobs on the link of that scoped name."""
        self.wrenches = [job for job in self.wrenches if f"{job.model.name}::{job.link}" != body]

    def forget(self, model: Model) -> None:
        """Drops a model's jobs; as in Gazebo, also those of equally named joints of other models."""
        names = set(model.all_joints)
        self.wrenches = [job for job in self.wrenches if job.model is not model]
        self.efforts = [job for job in self.efforts if job.joint not in names]

    def apply(self, now: int) -> None:
        """Pushes for the step that ends at `now` [ns], and drops the jobs that are over."""
        self._apply_wrenches(now)
        self._apply_efforts(now)

    def _apply_wrenches(self, now: int) -> None:
        # Gazebo sets a body's force and torque: of several jobs the one queued last counts.
        acting = {(id(j.model), j.link): j for j in self.wrenches if j.span.covers(now)}
        for job in acting.values():
            job.model.body.add_wrench(job.link, *job.wrench)
        self.wrenches = [job for job in self.wrenches if not job.span.is_over(now)]

    def _apply_efforts(self, now: int) -> None:
        for job in self.efforts:
            if job.span.covers(now) and job.joint in job.model.joint_names:
                index = job.model.joint_index(job.joint)
                job.model.body.add_effort(index, _truncated(job))
        self.efforts = [job for job in self.efforts if not job.span.is_over(now)]


def _truncated(job: EffortJob) -> float:
    """The effort within the joint's limit, and none that would speed it up beyond its velocity limit."""
    joint = job.model.description.joints[job.joint]
    _, speed = job.model.joint_state(job.joint)
    if 0.0 <= joint.velocity < abs(speed) and speed * job.effort > 0.0:
        return 0.0
    return job.effort if joint.effort < 0.0 else math.copysign(
        min(abs(job.effort), joint.effort), job.effort
    )  # fmt: skip


def in_world(wrench: Wrench, point: Vector, body: Pose, frame: Pose | None) -> Wrench:
    """Returns the wrench that acts when a client gives `wrench` at `point` [m] of `frame`.

    None is the world: `point` is then an offset from the body's centre of mass. Otherwise Gazebo turns the
    wrench into the body's axes and applies it as if those were the world's; so do we.
    """
    force, torque = wrench
    torque = add(torque, cross(point, force))
    if frame is None:
        return force, torque
    seen = frame.relative_to(body)
    force = rotate(seen.orientation, force)
    return force, add(rotate(seen.orientation, torque), cross(seen.position, force))
