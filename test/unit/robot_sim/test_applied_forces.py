"""Efforts and wrenches on joints and links (docs/contract/gazebo.md 2.18 and 2.19)."""

import math
from types import SimpleNamespace

import pytest

from robot_sim.applied_forces import ActingTime, AppliedEffort, AppliedForces, AppliedWrench, in_world
from robot_sim.physics.pose import Pose

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
    name = "robot"

    def __init__(self):
        self.body, self.speed = FakeBody(), 0.0
        free = SimpleNamespace(effort=-1.0, velocity=-1.0)
        bound = SimpleNamespace(effort=2.0, velocity=7.0)
        self.description = SimpleNamespace(joints={"a": free, "b": bound})

    def joint_index(self, name):
        return self.joint_names.index(name)

    def joint_state(self, name):
        return 0.0, self.speed


@pytest.mark.parametrize(
    ("joint", "speed", "values", "expected"),
    [
        ("b", 0.0, (1.0, 5.0, -9.0), [(1, 1.0), (1, 2.0), (1, -2.0)]),
        ("b", 8.0, (1.0, -1.0), [(1, 0.0), (1, -1.0)]),
        ("b", -8.0, (-1.0,), [(1, 0.0)]),
        ("b", 7.0, (1.0,), [(1, 1.0)]),
        ("a", 8.0, (1e9,), [(0, 1e9)]),
        ("fixed", 0.0, (1.0,), []),
    ],
)
def test_efforts_add_up_each_within_the_joints_limits(joint, speed, values, expected):
    model, applied = FakeModel(), AppliedForces()
    model.speed = speed
    for value in values:
        applied.efforts.append(AppliedEffort(model, joint, value, ActingTime(0, -1)))
    applied.apply(TICK)
    assert model.body.efforts == expected


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
    assert torque == pytest.approx((0.0, 0.0, -3.0))  # the body sees the frame at (3, 0, 0)
