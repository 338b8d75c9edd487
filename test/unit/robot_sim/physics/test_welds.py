"""Fixed joints that give a link two parents, or form rings, on each engine."""

from pathlib import Path

import pytest
from support.robots.linkages import CUBE, cube, weld
from support.robots.snippets import box, collision, sdf, sdf_link
from support.robots.worlds import run

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose, cross, from_rpy, subtract
from robot_sim.physics.properties import link_inertia

ROBOTS = Path(__file__).resolve().parents[3] / "data/robots"
CUBES = [cube("a", 0, 0), cube("b", CUBE, 0), cube("c", CUBE, CUBE), cube("d", 0, CUBE)]
WELDS = {
    "ring": ["ab", "bc", "dc", "ad"],
    "two parents": ["ab", "cb", "cd"],
    "twice": ["ab", "ab", "bc", "cd"],
    "circle": ["ab", "bc", "cd", "da"],
    "to the first": ["ba", "ca", "da"],
}
# A single box in place of the four cubes.
SHAPE = collision(box(f"{2 * CUBE} {2 * CUBE} {CUBE}"), "<pose>0.1 0.1 0 0 0 0</pose>")
MOMENTS = 5 * CUBE**2 / 3.0, 5 * CUBE**2 / 3.0, 8 * CUBE**2 / 3.0
SLAB = sdf_link("a", "0 0 0.1 0 0 0", SHAPE, 4.0, MOMENTS, "0.1 0.1 0")


def welded(which: str, static: bool = False) -> str:
    joints = [weld(f"{n}{pair}", *pair) for n, pair in enumerate(WELDS[which])]
    return sdf(*CUBES, *joints, static=static)


@pytest.fixture
def slab(make_world):
    """Worlds with the four cubes and with the slab, which move alike."""

    def spawn(which: str, pose: Pose, ground: bool):
        models = []
        for text in (welded(which), sdf(SLAB)):
            world = make_world(ground=ground)
            models.append((world, world.spawn("m", parse_sdf(text), pose)))
        return models

    return spawn


@pytest.mark.parametrize("which", WELDS)
def test_welded_links_fly_as_one_body(slab, which):
    ends = []
    for world, model in slab(which, Pose((0.0, 0.0, 9.0), from_rpy(0.1, 0.2, 0.3)), False):
        root, turning = model.link_state(model.description.root)[0], (3.0, -2.0, 1.0)
        arm = subtract(root.position, model.link_state("a")[0].position)
        model.body.reset_base(root, (cross(turning, arm), turning))
        run(world, 500)
        ends.append(model.link_state("a")[0])
    assert ends[0].position == pytest.approx(ends[1].position, abs=1e-3)
    assert ends[0].orientation == pytest.approx(ends[1].orientation, abs=1e-6)


def test_welded_links_stand_and_tip_as_one_body(slab):
    for torque, tips in ((7.5, False), (8.2, True)):  # [N m]; 4 kg * 9.8 m/s² * 0.2 m tip it
        turned = []
        for world, model in slab("ring", Pose(), True):
            run(world, 300)
            assert model.link_state("a")[0].position == pytest.approx((0.0, 0.0, 0.1), abs=1e-3)
            for _ in range(300):
                model.body.add_wrench("a", (0.0, 0.0, 0.0), (torque, 0.0, 0.0))
                world.step()
            turned.append(model.link_state("a")[0].orientation[0])
        assert [each > 0.01 for each in turned] == [tips, tips]
        assert turned[0] == pytest.approx(turned[1], abs=5e-3)


@pytest.mark.parametrize("static", [False, True])
@pytest.mark.parametrize("which", WELDS)
def test_welded_links_and_joints_keep_names_and_poses(world, which, static):
    model = world.spawn("m", parse_sdf(welded(which, static)), Pose((0.0, 0.0, 0.01)))
    assert model.link_names == ["a", "b", "c", "d"]
    assert model.all_joints == [f"{n}{pair}" for n, pair in enumerate(WELDS[which])]
    assert {model.joint_state(name) for name in model.all_joints} == {(0.0, 0.0)}
    run(world, 10)
    places = [pose.position for pose in model.link_poses()]
    assert subtract(places[2], places[0]) == pytest.approx((CUBE, CUBE, 0.0), abs=1e-6)
    assert link_inertia(model, "c").mass == 1.0


def test_a_bench_stands(world):
    description = parse_sdf((ROBOTS / "bench.sdf").read_text())
    model = world.spawn("bench", description, Pose())
    run(world, 500)
    assert model.state()[0].position == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    assert sum(link.inertia.mass for link in description.links.values() if link.inertia) == 20.0


def test_what_stays_apart_or_joins_itself_is_refused():
    for child, fault in (("b", "not joined"), ("a", "joins link 'a' to itself")):
        with pytest.raises(DescriptionError, match=fault):
            parse_sdf(sdf(*CUBES, weld("j", "a", child)))


def test_joints_move_above_welded_links(make_world):
    """A drawer of two boards that are welded twice."""
    world = make_world(gravity=(0.0, 0.0, 0.0))
    joints = [weld(f"w{number}", "b", "c") for number in range(2)]
    slide = '<joint name="s" type="prismatic"><parent>a</parent><child>b</child></joint>'
    model = world.spawn("m", parse_sdf(sdf(*CUBES[:3], slide, *joints)), Pose())
    model.set_joint_positions({"s": 0.5})
    assert model.link_state("c")[0].position == pytest.approx((CUBE, CUBE, 0.6), abs=1e-6)
