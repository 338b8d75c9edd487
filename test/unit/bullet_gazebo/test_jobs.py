"""Efforts and wrenches that act for a time: spans, adding up, overwriting, clearing.

See docs/contract/gazebo.md 2.18 and 2.19.
"""

import math
from types import SimpleNamespace

import pytest

from bullet_gazebo.jobs import EffortJob, Jobs, Span, WrenchJob, in_world
from bullet_gazebo.physics.pose import Pose

TICK = 1_000_000  # [ns]
NOTHING = (0.0, 0.0, 0.0)


class FakeBody:
    def __init__(self):
        self.efforts, self.wrenches = [], []

    def add_effort(self, index, effort):
        self.efforts.append((index, effort))

    def add_wrench(self, link, force, torque):
        self.wrenches.append((link, force, torque))


class FakeModel:
    """A model whose joint `a` is unlimited and whose joint `b` has 2 N m and 7 rad/s."""

    joint_names = ("a", "b")
    all_joints = ("a", "b", "fixed")

    def __init__(self, name="robot"):
        self.name, self.body, self.speed = name, FakeBody(), 0.0
        limits = {"a": (-1.0, -1.0), "b": (2.0, 7.0)}
        self.description = SimpleNamespace(
            joints={
                name: SimpleNamespace(effort=effort, velocity=velocity)
                for name, (effort, velocity) in limits.items()
            }
        )

    def joint_index(self, name):
        return self.joint_names.index(name)

    def joint_state(self, name):
        return 0.0, self.speed


def ticks(job, count=20, now=0):
    """On which ticks after `now` an effort acts."""
    jobs, acted = Jobs(), []
    jobs.add_effort(job)
    for tick in range(1, count + 1):
        job.model.body.efforts.clear()
        jobs.apply(now + tick * TICK)
        if job.model.body.efforts:
            acted.append(tick)
    return acted, jobs


def effort(start=0, duration=-1, joint="a", value=1.0, model=None):
    return EffortJob(model or FakeModel(), joint, value, Span(start, duration))


@pytest.mark.parametrize(
    "start, duration, acted",
    [
        (0, -1, list(range(1, 21))),  # for ever
        (0, 0, []),
        (0, TICK - 1, []),  # shorter than a step
        (0, TICK, [1]),
        (0, 3 * TICK + 5, [1, 2, 3]),
        (5 * TICK, 0, [5]),  # in the future: one more
        (5 * TICK, 3 * TICK, [5, 6, 7, 8]),
        (18 * TICK, -1, [18, 19, 20]),
    ],
)
def test_when_a_job_acts(start, duration, acted):
    found, jobs = ticks(effort(start, duration))
    assert found == acted
    assert bool(jobs.efforts) == (duration < 0)


def test_efforts_add_up_each_clamped_to_the_joint():
    model, jobs = FakeModel(), Jobs()
    for value in (1.0, 5.0, -9.0):
        jobs.add_effort(effort(joint="b", value=value, model=model))
    jobs.apply(TICK)
    assert model.body.efforts == [(1, 1.0), (1, 2.0), (1, -2.0)]


@pytest.mark.parametrize("speed, value, applied", [(8.0, 1.0, 0.0), (8.0, -1.0, -1.0),
                                                   (-8.0, -1.0, 0.0), (7.0, 1.0, 1.0)])  # fmt: skip
def test_no_effort_beyond_the_velocity_limit(speed, value, applied):
    model, jobs = FakeModel(), Jobs()
    model.speed = speed
    jobs.add_effort(effort(joint="b", value=value, model=model))
    jobs.apply(TICK)
    assert model.body.efforts == [(1, applied)]


def test_an_effort_on_a_fixed_joint_does_nothing():
    model, jobs = FakeModel(), Jobs()
    jobs.add_effort(effort(joint="fixed", model=model))
    jobs.apply(TICK)
    assert model.body.efforts == []


def wrench(model, force, link="cart", duration=-1):
    return WrenchJob(model, link, (force, NOTHING), Span(0, duration))


def test_the_wrench_queued_last_counts():
    model, jobs = FakeModel(), Jobs()
    jobs.add_wrench(wrench(model, (1.0, 0.0, 0.0)))
    jobs.add_wrench(wrench(model, (2.0, 0.0, 0.0), duration=TICK))
    jobs.add_wrench(wrench(model, (3.0, 0.0, 0.0), link="pole"))
    jobs.apply(TICK)
    jobs.apply(2 * TICK)
    forces = [(link, force[0]) for link, force, _ in model.body.wrenches]
    assert forces == [("cart", 2.0), ("pole", 3.0), ("cart", 1.0), ("pole", 3.0)]


def test_joint_forces_are_cleared_by_plain_name_in_all_models():
    jobs = Jobs()
    one, other = FakeModel("one"), FakeModel("other")
    for model in (one, other):
        jobs.add_effort(effort(model=model))
    jobs.clear_efforts("one::a")
    jobs.apply(TICK)
    jobs.clear_efforts("a")
    jobs.apply(2 * TICK)
    assert one.body.efforts == other.body.efforts == [(0, 1.0)]
    assert jobs.efforts == []


def test_wrenches_are_cleared_by_scoped_name():
    jobs = Jobs()
    one, other = FakeModel("one"), FakeModel("other")
    for model in (one, other):
        jobs.add_wrench(wrench(model, (1.0, 0.0, 0.0)))
    jobs.clear_wrenches("cart")
    jobs.clear_wrenches("one::cart")
    jobs.apply(TICK)
    assert one.body.wrenches == []
    assert len(other.body.wrenches) == 1


def test_a_deleted_model_takes_its_jobs_along():
    """As in Gazebo, efforts on equally named joints of other models as well."""
    jobs = Jobs()
    one, other = FakeModel("one"), FakeModel("other")
    for model in (one, other):
        jobs.add_effort(effort(model=model))
        jobs.add_wrench(wrench(model, (1.0, 0.0, 0.0)))
    jobs.forget(one)
    jobs.apply(TICK)
    assert one.body.wrenches == one.body.efforts == other.body.efforts == []
    assert len(other.body.wrenches) == 1


def turned(angle, position=NOTHING):
    return Pose(position, (0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2)))


def test_in_the_world_a_point_is_an_offset_from_the_centre_of_mass():
    body = turned(1.0, (5.0, 5.0, 5.0))
    force, torque = in_world(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 2.0, 0.0), body, None)
    assert force == (1.0, 0.0, 0.0)
    assert torque == (0.0, 0.0, -1.0)


def test_in_a_frame_the_wrench_is_turned_into_the_body_and_applied_as_if_in_the_world():
    """Gazebo's own semantics: only right when the body is not turned."""
    body, frame = turned(math.pi / 2, (1.0, 0.0, 0.0)), turned(0.0, (1.0, 3.0, 0.0))
    force, torque = in_world(((1.0, 0.0, 0.0), NOTHING), NOTHING, body, frame)
    assert force == pytest.approx((0.0, -1.0, 0.0))
    assert torque == pytest.approx(
        (0.0, 0.0, -3.0)
    )  # the frame is at (3, 0, 0), seen from the body
