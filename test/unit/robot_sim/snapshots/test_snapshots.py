"""Snapshots of a world: the same commands lead to the same bits, or the snapshot is refused."""

import copy
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.robots.branches import check_branches, future
from support.robots.cartpole import CONTROLLERS, cartpole_urdf
from support.robots.grippers import cube, gripper
from support.robots.worlds import add_robot, start

from robot_sim.applied_forces import ActingTime, AppliedEffort, AppliedWrench
from robot_sim.physics.engines.bullet_engine import BulletEngine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.physics.properties import JointProperties, set_joint_properties
from robot_sim.physics.world import World
from robot_sim.simulator import Simulator
from robot_sim.snapshot import Snapshot, SnapshotError

S = 1_000_000_000  # [ns]
PUSH = ((0.5, 0.0, 0.0), (0.0, 0.0, 0.01))  # [N], [N m]
OFF_CENTRE = Pose((0.01, 0.0, 0.0))


def test_a_snapshot_changes_nothing_where_nothing_touches_and_in_mujoco_nowhere(sim):
    robot = add_robot(sim, "cartpole", cartpole_urdf())
    start(robot, CONTROLLERS)
    if not isinstance(sim.world.engine, BulletEngine):  # whose contacts begin anew
        pose = Pose((3.0, 0.0, 0.06), from_rpy(0.4, 0.3, 0.2))
        sim.world.spawn("cube", parse_urdf(cube()), pose)
    runs = []
    for saves in (False, True):
        sim.reset_simulation()
        robot.manager.get("cart").command(0.3)
        runs.append([])
        for _ in range(30):
            runs[-1] += future(sim, 10)
            if saves:
                sim.save_state()
    assert runs[0] == runs[1]
    assert any(contacts for _, _, contacts, _ in runs[0]) == ("cube" in sim.world.models)


def test_bodies_that_tumble_and_touch(sim):
    for number in range(4):
        pose = Pose((0.02 * number, 0.01 * number, 0.1 + 0.09 * number))
        sim.world.spawn(f"cube_{number}", parse_urdf(cube()), pose)
    while not sim.world.contacts():
        future(sim, 1)
    first = check_branches(sim, lambda: sim.reset_world() or future(sim, 30))
    assert any(contacts for _, _, contacts, _ in first)


def test_a_snapshot_of_what_was_restored_is_the_same(sim):
    sim.world.spawn("cube", parse_urdf(cube()), Pose((0.0, 0.0, 0.2), from_rpy(0.4, 0.3, 0.2)))
    for _ in range(20):
        future(sim, 7)  # to orientations that the engine normalises in other ways
        first = sim.save_state().whole()
        again = sim.save_state().whole()
        sim.restore_state(first)
        restored = sim.save_state().whole()
        assert first.to_bytes() == again.to_bytes() == restored.to_bytes()


def test_contacts_are_those_of_the_saved_tick_until_the_next_one(sim):
    sim.world.spawn("cube", parse_urdf(cube()), Pose((0.0, 0.0, 0.05)))
    while not sim.world.contacts():
        future(sim, 1)
    before = sim.world.contacts()
    snapshot = sim.save_state()
    assert sim.world.contacts() == before != []
    sim.place_model(sim.world.models["cube"], Pose((0.0, 0.0, 5.0)), ((0.0,) * 3, (0.0,) * 3))
    future(sim, 2)
    assert not sim.world.contacts()
    sim.restore_state(snapshot)
    assert sim.world.contacts() == before


def test_what_is_attached_comes_back_and_what_was_not_goes(sim):
    robot = sim.world.spawn("gripper", parse_urdf(gripper()), Pose((0.0, 0.0, 0.3)))
    box = sim.world.spawn("cube", parse_urdf(cube()), Pose((0.15, 0.0, 0.6)))
    ends = (robot, "lift_link"), (box, "cube_link")

    def detach():
        sim.world.detach(sim.world.attachments[0])

    sim.world.attach(*ends)
    future(sim, 20)
    check_branches(sim, detach)
    check_branches(sim, lambda: [detach(), sim.world.attach(*ends)])
    detach()
    check_branches(sim, lambda: sim.world.attach(*ends))
    assert not sim.world.attachments


def held_cube(sim):
    robot = sim.world.spawn("gripper", parse_urdf(gripper()), Pose((0.0, 0.0, 0.3)))
    box = sim.world.spawn("cube", parse_urdf(cube()), Pose((0.15, 0.0, 0.6)))
    sim.world.attach((robot, "lift_link"), (box, "cube_link"))
    sim.applied.wrenches.append(AppliedWrench(box, "cube_link", PUSH, ActingTime(0, -1)))
    sim.applied.efforts.append(AppliedEffort(robot, "lift", 20.0, ActingTime(0, S)))
    future(sim, 20)


def test_planes_may_go_and_come_back_as_they_were_where_nothing_acts_on_them(sim):
    held_cube(sim)
    (plane,) = [model for model in sim.world.models.values() if model.description.is_plane]

    def respawn(description=plane.description):
        sim.delete_model(sim.world.models[plane.name])
        return sim.world.spawn(plane.name, description, plane.initial_pose)

    check_branches(sim, respawn)
    snapshot = sim.save_state()
    fresh = respawn()
    sim.applied.wrenches.append(AppliedWrench(fresh, plane.link_names[0], PUSH, ActingTime(0, -1)))
    pushed = sim.save_state()
    sim.delete_model(sim.world.models[plane.name])
    before = future(sim, 3)[-1]
    with pytest.raises(SnapshotError, match=f"acts on the link '{plane.name}::.*isn't here"):
        sim.restore_state(pushed)
    assert sim.now == before[0]
    sim.restore_state(snapshot)
    link = plane.description.links[plane.link_names[0]]
    icy = replace(link, collisions=[replace(shape, mu=0.01) for shape in link.collisions])
    sim.world.spawn(plane.name, replace(plane.description, links={link.name: icy}), plane.initial_pose)
    with pytest.raises(SnapshotError, match=f"'{plane.name}' has another description"):
        sim.restore_state(snapshot)


FORGED = {
    "a gear": ("fastened", lambda was: dict.fromkeys(was, (3, 0, 0, -1, 6))),
    "no length": ("fastened", lambda was: {n: Pose((0.0,) * 3, (0.0,) * 4) for n in was}),
    "nowhere": ("fastened", lambda was: {n: Pose((np.float32("nan"), 0.0, 0.0)) for n in was}),
    "loose": ("fastened", lambda was: {}),
    "of no link": ("attachments", lambda was: [((each[0][0], "x"), *each[1:]) for each in was]),
    "of no model": ("attachments", lambda was: [(("x", "x"), *each[1:]) for each in was]),
    "on no link": ("wrenches", lambda was: [(each[0], "x", *each[2:]) for each in was]),
    "empty": ("wrenches", lambda was: [(*each[:2], (), each[3]) for each in was]),
    "no number": ("wrenches", lambda was: [(*each[:2], ((math.nan,) * 3,) * 2, each[3]) for each in was]),
    "endless": ("wrenches", lambda was: [(*each[:2], ((2**62,) * 3,) * 2, each[3]) for each in was]),
    "a text": ("efforts", lambda was: [(*each[:2], "x", each[3]) for each in was]),
}


@pytest.mark.parametrize(("part", "forge"), FORGED.values(), ids=FORGED)
def test_forged_forces_and_attachments_leave_the_world_as_it_was(sim, part, forge):
    held_cube(sim)
    good = sim.save_state()
    first = future(sim, 30)
    content = copy.deepcopy(good.state)
    place = content["world" if part in content["world"] else "applied"]
    place[part] = forge(place[part])
    sim.restore_state(good)
    future(sim, 10)
    with pytest.raises(SnapshotError):
        sim.restore_state(Snapshot(good.fits, content, is_foreign=True))
    assert future(sim, 20) == first[10:]
    sim.restore_state(good)
    assert future(sim, 30) == first


def chain_of_cubes(sim):
    ends = []
    for k in range(5):
        pose = Pose((0.06 * k, 0.01 * k, 0.06 + 0.02 * k))
        ends.append((sim.world.spawn(f"cube_{k}", parse_urdf(cube()), pose), "cube_link"))
    for first, second in pairwise(ends):
        sim.world.attach(first, second)
    return ends


def test_attachments_of_which_one_was_released_before(sim):
    chain_of_cubes(sim)
    future(sim, 20)
    sim.world.detach(sim.world.attachments[0])
    future(sim, 30)
    check_branches(sim, lambda: sim.world.detach(sim.world.attachments[0]) or future(sim, 10))


def test_a_link_that_is_another_one_to_the_engine_since_is_refused_while_attached(sim):
    *_, (model, link) = chain_of_cubes(sim)  # the engine takes it last then, too
    snapshot = sim.save_state()
    inertia, body = model.description.links[link].inertia, model.body
    sim.world.set_inertia(model, link, replace(inertia, com=OFF_CENTRE))
    sim.world.set_inertia(model, link, inertia)
    is_loaded_again = model.body is not body
    sim.reset_world()
    if is_loaded_again:
        with pytest.raises(SnapshotError, match="attached"):
            sim.restore_state(snapshot)
        assert not sim.world.attachments
    else:
        sim.restore_state(snapshot)
        assert len(sim.world.attachments) == 4
    for each in list(sim.world.attachments):
        sim.world.detach(each)


@pytest.mark.parametrize("change", ["delete", "load"])
def test_it_saves_again_after_a_body_has_gone_that_touched_something(sim, change):
    model = sim.world.spawn("cube", parse_urdf(cube()), Pose((0.0, 0.0, 0.03)))
    future(sim, 40)
    sim.save_state()
    if change == "delete":
        sim.delete_model(model)
    else:
        inertia = model.description.links["cube_link"].inertia
        sim.world.set_inertia(model, "cube_link", replace(inertia, com=OFF_CENTRE))
    sim.restore_state(sim.save_state())


def test_models_come_back_in_their_order_of_the_engine(sim):
    """A link with another centre of mass is loaded anew, and meets the others in another order."""
    lower, upper = (
        sim.world.spawn(name, parse_urdf(cube()), Pose((0.01, 0.0, height)))
        for name, height in (("lower", 0.03), ("upper", 0.085))
    )
    future(sim, 40)

    def change(model):
        inertia = model.description.links["cube_link"].inertia
        sim.world.set_inertia(model, "cube_link", replace(inertia, com=OFF_CENTRE))
        sim.world.set_inertia(model, "cube_link", inertia)

    check_branches(sim, lambda: change(upper))
    check_branches(sim, lambda: change(lower))


def test_motors_efforts_and_wrenches_that_act_for_a_time(sim):
    robot = sim.world.spawn("gripper", parse_urdf(gripper()), Pose((0.0, 0.0, 0.5)))
    robot.set_motor("lift", 0.1, 50.0)
    box = sim.world.spawn("cube", parse_urdf(cube()), Pose((1.0, 0.0, 0.1)))
    sim.applied.efforts.append(AppliedEffort(robot, "lift", 20.0, ActingTime(0, S // 20)))
    sim.applied.wrenches.append(AppliedWrench(box, "cube_link", PUSH, ActingTime(0, S // 10)))
    future(sim, 20)

    def between():
        future(sim, 200)
        assert not sim.applied.efforts and not sim.applied.wrenches
        robot.set_motor("lift", -0.3, 10.0)

    check_branches(sim, between)


def test_another_world_is_refused_and_stays_as_it_is(sim, new_engine):
    robot = add_robot(sim, "cartpole", cartpole_urdf())
    start(robot, CONTROLLERS)
    model = robot.model
    snapshot = sim.save_state()

    def refused(why):
        future(sim, 3)
        before = sim.now, model.joint_states()
        with pytest.raises(SnapshotError, match=why):
            sim.restore_state(snapshot)
        assert (sim.now, model.joint_states()) == before

    changed = JointProperties(damping=0.5)
    set_joint_properties(model, "cart_pole", changed, sim.world.time_step)
    refused("cartpole.*stop or damping of a joint")
    set_joint_properties(model, "cart_pole", JointProperties(damping=0.0), sim.world.time_step)
    model.set_friction("cart", 1.0)
    sim.restore_state(snapshot)  # all is as it was
    sim.world.set_gravity((0.0, 0.0, -3.0))
    refused("gravity")
    sim.world.set_gravity((0.0, 0.0, -9.8))
    robot.manager.switch([], ["cart"])
    refused("controllers")
    robot.manager.switch(["cart"], [])
    sim.world.spawn("cube", parse_urdf(cube()), Pose((1.0, 0.0, 1.0)))
    refused("models")
    other = Simulator(World(new_engine()), lockstep=True)
    with pytest.raises(SnapshotError, match="the models"):
        other.restore_state(snapshot)
    other.world.close()


def test_thousands_of_snapshots_are_freed(sim):
    model = sim.world.spawn("cube", parse_urdf(cube()), Pose((0.0, 0.0, 0.1)))
    kept = []
    for number in range(3000):
        snapshot = sim.save_state()
        if number % 1000 == 0:
            kept.append((snapshot, model.state()))
        sim.advance(1)
    for snapshot, state in kept:
        sim.restore_state(snapshot)
        assert model.state() == state
