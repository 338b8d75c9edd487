"""Links in any frame, models and contacts, as a client asks for them; on both engines."""

import math

import pytest
from support.refusals import refused
from support.robots.arm_and_box import BOX, MASS, ArmAndBox, commands
from support.robots.worlds import run

from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, conjugate, from_rpy, rotate, subtract
from robot_sim.state import LinkQuery, StateQuery, StateReader, UnknownName

UPPER, FORE, HEIGHT, BEND = 0.3, 0.2, 0.6, 0.5  # [m] and, of the tip's frame, [rad]
WEIGHT = MASS * 9.8  # [N]
LYING = Pose((0.0, 0.0, 0.1))  # the box, upright
OF_BOX = StateQuery(contacts_of=("box",))


@pytest.fixture(params=["bullet", pytest.param("mujoco", marks=pytest.mark.extras("mujoco"))])
def scene(request):
    made = ArmAndBox(request.param)
    yield made
    made.close()


def link(scene, name, frame=""):
    return scene.read(StateQuery(links=(LinkQuery(name, frame),))).links[0]


def settled(world, pose=LYING):
    """What touches a box that has come to rest."""
    world.spawn("box", parse_urdf(BOX), pose)
    run(world, 600)
    return StateReader(world, OF_BOX).read().contacts


def test_a_link_is_where_the_joints_put_it_one_that_is_fixed_to_another_included(scene):
    a, b, da, db = 0.3, -0.9, 0.7, -1.1
    scene.reset({"shoulder": (a, da), "elbow": (b, db)})
    pose, (linear, angular) = link(scene, "tip")
    x, z = UPPER * math.cos(a), -UPPER * math.sin(a)
    fx, fz = FORE * math.cos(a + b), -FORE * math.sin(a + b)
    assert pose.position == pytest.approx((x + fx, 0.0, HEIGHT + z + fz), abs=1e-6)
    assert pose.orientation == pytest.approx(from_rpy(0.0, a + b + BEND, 0.0), abs=1e-6)
    wanted = (da * z + (da + db) * fz, 0.0, -da * x - (da + db) * fx)
    assert linear == pytest.approx(wanted, abs=1e-6)
    assert angular == pytest.approx((0.0, da + db, 0.0), abs=1e-6)


def test_a_link_in_anothers_frame_is_as_get_link_state_tells_it(scene):
    """Velocities are differences, without that of the turning frame."""
    scene.reset()
    (tip, tip_twist), (upper, upper_twist) = link(scene, "tip"), link(scene, "upper")
    pose, twist = link(scene, "two_link_arm::tip", "upper")
    assert pose == tip.relative_to(upper)
    back = conjugate(upper.orientation)
    for part in range(2):
        assert twist[part] == rotate(back, subtract(tip_twist[part], upper_twist[part]))
    assert link(scene, "tip", "world") == (tip, tip_twist)
    still, rest = link(scene, "tip", "tip")
    assert still.position == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert rest == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_models_are_told_by_name_in_the_order_asked_for(scene):
    scene.reset()
    told = scene.read(StateQuery(models=("two_link_arm", "box"))).models
    assert list(told) == ["two_link_arm", "box"]
    assert told["box"][0].position == pytest.approx((-0.5, 0.1, 0.25), abs=1e-6)
    assert told["box"][1][1] == pytest.approx((0.0, 1.0, 0.3), abs=1e-6)
    everything = scene.read(StateQuery(all_models=True)).models
    assert list(everything) == ["ground_plane", "two_link_arm", "box"]


def test_what_isnt_asked_for_isnt_told(scene):
    scene.reset()
    scene.act((0.0, 0.0), 300)  # the box lies on the ground
    assert scene.read(StateQuery()) == ({}, [], [])
    assert scene.read(StateQuery(contacts_of=("fore",))).contacts == []
    assert scene.read(StateQuery(all_contacts=True)).contacts != []


def test_on_a_slope_the_wrench_is_weight_and_friction(world):
    slope = 0.3  # [rad]; below the angle at which it slides
    world.set_gravity((9.8 * math.sin(slope), 0.0, -9.8 * math.cos(slope)))
    (pair,) = settled(world)
    assert pair.first == "box::box::box_fixed_joint_lump__lower_collision"
    assert pair.second == "ground_plane::link::collision"
    force, torque = pair.total
    expected = (-WEIGHT * math.sin(slope), 0.0, WEIGHT * math.cos(slope))
    assert force == pytest.approx(expected, abs=1e-3)
    assert torque == pytest.approx((0.0, 0.0, 0.0), abs=1e-2)  # it doesn't tip over
    assert len(pair.points) == len(pair.normals) == len(pair.wrenches) == len(pair.depths) >= 3
    for point, normal, depth in zip(pair.points, pair.normals, pair.depths, strict=True):
        assert abs(point[2]) < 1e-3
        assert normal == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
        assert abs(depth) < 1e-3


def test_what_was_asked_for_comes_first_and_forces_act_on_it(world):
    (on_box,) = settled(world)
    (on_ground,) = StateReader(world, StateQuery(contacts_of=("ground_plane",))).read().contacts
    assert (on_ground.first, on_ground.second) == (on_box.second, on_box.first)
    assert on_ground.total[0] == tuple(-part for part in on_box.total[0])
    assert on_ground.total[0][2] == pytest.approx(-WEIGHT, rel=0.01)
    assert on_ground.normals[0] == pytest.approx((0.0, 0.0, -1.0), abs=1e-6)


def test_of_several_collisions_it_is_told_which_one_touches(world):
    (pair,) = settled(world, Pose((0.0, 0.0, 0.1), from_rpy(math.pi, 0.0, 0.0)))
    # It stands on its head.
    assert pair.first == "box::box::box_fixed_joint_lump__upper_collision_1"
    for name, count in (
        ("box_fixed_joint_lump__upper_collision_1", 1),
        ("box_fixed_joint_lump__lower_collision", 0),
        ("box::box", 1),
    ):
        found = StateReader(world, StateQuery(contacts_of=(name,))).read().contacts
        assert len(found) == count, name


SHAPES = {
    "sphere": '<sphere radius="0.1"/>',
    "cylinder": '<cylinder radius="0.1" length="0.2"/>',
    "mesh": '<mesh filename="{mesh}"/>',
}


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_shapes_of_every_kind_are_told_apart(world, root, shape):
    mesh = root / "test/data/models/crate/meshes"
    file = next(path for path in sorted(mesh.iterdir()) if path.suffix in (".stl", ".obj", ".dae"))
    text = BOX.replace('<box size="0.2 0.2 0.1"/></geometry></collision>\n</link>',
                       f"{shape.format(mesh=file)}</geometry></collision></link>")  # fmt: skip
    assert text != BOX
    world.spawn("box", parse_urdf(text), Pose((0.0, 0.0, 0.3), from_rpy(math.pi, 0.0, 0.0)))
    reader = StateReader(world, OF_BOX)
    while not (contacts := reader.read().contacts):
        world.step()
        assert world.models["box"].state()[0].position[2] > 0.0
    assert {pair.first for pair in contacts} == {"box::box::box_fixed_joint_lump__upper_collision_1"}


def test_a_fall_is_told_from_the_first_touch_on(scene):
    seen = scene.episode()
    touching = [bool(answer.contacts) for answer in seen]
    assert not any(touching[:5])
    assert any(touching)
    heights = [answer.models["box"][0].position[2] for answer in seen]
    assert min(heights) > 0.05
    assert heights[-1] < 0.15


def test_the_same_episode_gives_the_same_bits_and_asking_changes_none(scene):
    first, again = scene.episode(), scene.episode()
    assert first == again
    for watched in (False, True):  # as a window watches
        scene.reset()
        for step in range(len(first) - 1):
            scene.act(commands(step))
            for model in scene.sim.world.models.values() if watched else ():
                assert model.link_poses() == [model.link_state(n)[0] for n in model.link_names]
        assert scene.read() == first[-1]


def test_a_model_that_was_placed_touches_nothing_before_a_step(world):
    assert settled(world)
    reader = StateReader(world, StateQuery(all_contacts=True))
    world.models["box"].place(Pose((0.0, 0.0, 5.0)))
    assert reader.read(stepped=False).contacts == []
    world.step()
    assert reader.read().contacts == []


def test_names_are_found_again_in_a_model_that_came_back(world):
    settled(world)
    reader = StateReader(world, StateQuery(links=(LinkQuery("box"),), contacts_of=("box",)))
    world.delete("box")
    with pytest.raises(UnknownName, match="there is no link 'box'"):
        reader.read()
    world.spawn("box", parse_urdf(BOX), Pose((0.0, 0.0, 3.0)))
    answer = reader.read()
    assert answer.links[0][0].position[2] == pytest.approx(3.0)
    assert answer.contacts == []


@pytest.mark.parametrize(
    ("query", "text"),
    [
        (StateQuery(models=("bx",)), "there is no model 'bx'; did you mean 'box'?"),
        (StateQuery(links=(LinkQuery("tipp"),)), "there is no link 'tipp'; did you mean 'tip'?"),
        (
            StateQuery(links=(LinkQuery("two_link_arm::upr"),)),
            "there is no link 'two_link_arm::upr'; did you mean 'two_link_arm::upper'?",
        ),
        (StateQuery(links=(LinkQuery("tip", "bsae"),)), "no link 'bsae'; did you mean 'base'?"),
        (StateQuery(links=(LinkQuery("world"),)), "there is no link 'world'"),
        (StateQuery(links=(LinkQuery("nobody::tip"),)), "there is no link 'nobody::tip'"),
        (StateQuery(links=(LinkQuery(""),)), "there is no link ''"),
        (
            StateQuery(contacts_of=("box_fixed_joint_lump__lower_colision",)),
            "link or collision 'box_fixed_joint_lump__lower_colision'; did you mean "
            "'box_fixed_joint_lump__lower_collision'?",
        ),
        (StateQuery(contacts_of=("upper",)), "link 'upper' has no collision"),
        (
            StateQuery(contacts_of=("tip",)),
            "link 'tip' is fixed to 'fore' and part of it; the collisions there are: fore_collision, "
            "fore_fixed_joint_lump__tip_collision_1",
        ),
        (StateQuery(contacts_of=("zzz",)), "there is no model, link or collision 'zzz'"),
    ],
)
def test_unknown_names_are_refused_with_the_nearest_one(scene, query, text):
    with refused(text, error=UnknownName):
        scene.read(query)


def test_plain_names_of_several_models_are_refused_and_scoped_ones_taken(world):
    for name, x in (("left", 0.0), ("right", 1.0)):
        world.spawn(name, parse_urdf(BOX), Pose((x, 0.0, 0.1)))
    run(world, 600)
    for query, text in (
        (StateQuery(links=(LinkQuery("box"),)), "several models have a link 'box'"),
        (StateQuery(contacts_of=("box",)), "several models have a link or collision 'box'"),
    ):
        with pytest.raises(UnknownName, match=text):
            StateReader(world, query)
    query = StateQuery(links=(LinkQuery("left::box", "right::box"),), contacts_of=("right::box",))
    answer = StateReader(world, query).read()
    assert answer.links[0][0].position[0] == pytest.approx(-1.0, abs=1e-3)
    [pair] = answer.contacts
    assert pair.first == "right::box::box_fixed_joint_lump__lower_collision"
