"""Efforts and wrenches that act for a time: spans, adding up, overwriting, clearing.

See docs/contract/gazebo.md 2.18 and 2.19.
"""

import math
from types import SimpleNamespace

import pytest

from bullet_gazebo.applied_forces import (
    ActingTime,
    AppliedEffort,
    AppliedForces,
    AppliedWrench,
    in_world,
)
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


def ticks(each, count=20, now=0):
    """On which ticks after `now` an effort acts."""
    applied, acted = AppliedForces(), []
    applied.efforts.append(each)
    for tick in range(1, count + 1):
        each.model.body.efforts.clear()
        applied.apply(now + tick * TICK)
        if each.model.body.efforts:
            acted.append(tick)
    return acted, applied


def effort(start=0, duration=-1, joint="a", value=1.0, model=None):
    return AppliedEffort(model or FakeModel(), joint, value, ActingTime(start, duration))


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
def test_when_an_effort_acts(start, duration, acted):
    found, applied = ticks(effort(start, duration))
    assert found == acted
    assert bool(applied.efforts) == (duration < 0)


def test_efforts_add_up_each_clamped_to_the_joint():
    model, applied = FakeModel(), AppliedForces()
    for value in (1.0, 5.0, -9.0):
        applied.efforts.append(effort(joint="b", value=value, model=model))
    applied.apply(TICK)
    assert model.body.efforts == [(1, 1.0), (1, 2.0), (1, -2.0)]


@pytest.mark.parametrize("speed, value, expected", [(8.0, 1.0, 0.0), (8.0, -1.0, -1.0),
                                                   (-8.0, -1.0, 0.0), (7.0, 1.0, 1.0)])  # fmt: skip
def test_no_effort_beyond_the_velocity_limit(speed, value, expected):
    model, applied = FakeModel(), AppliedForces()
    model.speed = speed
    applied.efforts.append(effort(joint="b", value=value, model=model))
    applied.apply(TICK)
    assert model.body.efforts == [(1, expected)]


def test_an_effort_on_a_fixed_joint_does_nothing():
    model, applied = FakeModel(), AppliedForces()
    applied.efforts.append(effort(joint="fixed", model=model))
    applied.apply(TICK)
    assert model.body.efforts == []


def wrench(model, force, link="cart", duration=-1):
    return AppliedWrench(model, link, (force, NOTHING), ActingTime(0, duration))


def test_the_wrench_queued_last_counts():
    model, applied = FakeModel(), AppliedForces()
    applied.wrenches.append(wrench(model, (1.0, 0.0, 0.0)))
    applied.wrenches.append(wrench(model, (2.0, 0.0, 0.0), duration=TICK))
    applied.wrenches.append(wrench(model, (3.0, 0.0, 0.0), link="pole"))
    applied.apply(TICK)
    applied.apply(2 * TICK)
    forces = [(link, force[0]) for link, force, _ in model.body.wrenches]
    assert forces == [("cart", 2.0), ("pole", 3.0), ("cart", 1.0), ("pole", 3.0)]


def test_joint_forces_are_cleared_by_plain_name_in_all_models():
    applied = AppliedForces()
    one, other = FakeModel("one"), FakeModel("other")
    for model in (one, other):
        applied.efforts.append(effort(model=model))
    applied.clear_efforts("one::a")
    applied.apply(TICK)
    applied.clear_efforts("a")
    applied.apply(2 * TICK)
    assert one.body.efforts == other.body.efforts == [(0, 1.0)]
    assert applied.efforts == []


def test_wrenches_are_cleared_by_scoped_name():
    applied = AppliedForces()
    one, other = FakeModel("one"), FakeModel("other")
    for model in (one, other):
        applied.wrenches.append(wrench(model, (1.0, 0.0, 0.0)))
    applied.clear_wrenches("cart")
    applied.clear_wrenches("one::cart")
    applied.apply(TICK)
    assert one.body.wrenches == []
    assert len(other.body.wrenches) == 1


def test_a_deleted_model_takes_what_acts_on_it_along():
    """As in Gazebo, efforts on equally named joints of other models as well."""
    applied = AppliedForces()
    one, other = FakeModel("one"), FakeModel("other")
    for model in (one, other):
        applied.efforts.append(effort(model=model))
        applied.wrenches.append(wrench(model, (1.0, 0.0, 0.0)))
    applied.forget(one)
    applied.apply(TICK)
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
