"""What the second engine does in its own way: a world compiled anew, motors, contacts and meshes."""

import math

import pytest
from support.refusals import refused
from support.robots.cartpole import cartpole_urdf
from support.robots.snippets import WORLD, box, collision, joint, link, robot, sdf, sdf_link
from support.robots.worlds import run

from robot_sim.physics.description import Shape
from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.physics.world import World, ground_plane

pytestmark = pytest.mark.extras("mujoco")


@pytest.fixture
def world():
    world = World(make_engine("mujoco"))
    yield world
    world.close()


def block(mu="1", geometry="", static=False):
    surface = f"<surface><friction><ode><mu>{mu}</mu></ode></friction></surface>"
    shape = collision(geometry or box("0.2 0.2 0.2"), surface)
    return parse_sdf(sdf(sdf_link("l", more=shape, moment=0.01), static=static))


def slider(more=""):
    limit = 'lower="-9" upper="9" effort="9" velocity="9"'
    slide = joint("j", "prismatic", "world", "s", more=more, axis="1 0 0", limit=limit)
    return parse_urdf(robot(WORLD, link("s", 2.0), slide))


def test_models_that_come_and_go_leave_the_others_as_they_are(world):
    pole = world.spawn("a", parse_urdf(cartpole_urdf()), Pose())
    ball = world.spawn("b", block(), Pose((3.0, 0.0, 2.0), from_rpy(0.3, 0.2, 0.1)))
    pole.body.reset_joint(1, 0.3, 1.0)
    ball.place(ball.state()[0], ((1.0, 2.0, 3.0), (0.4, 0.5, 0.6)))
    run(world, 100)
    before = [pole.joint_states(), pole.link_state("pole"), *ball.state()]
    for change in (lambda: world.spawn("c", slider(), Pose((0.0, 5.0, 0.0))), lambda: world.delete("c")):
        change()
        assert [pole.joint_states(), pole.link_state("pole"), *ball.state()] == before


def test_a_world_with_company_gives_the_same_bits(world):
    tracks = []
    for _ in range(2):
        model = world.spawn("a", parse_urdf(cartpole_urdf()), Pose())
        model.body.reset_joint(1, 0.3, 1.0)
        model.body.apply_efforts((3.0, 0.0))
        if tracks:  # comes while an effort waits for the next step, which must not be lost
            world.spawn("b", slider(), Pose((0.0, 5.0, 0.0)))
        run(world, 500)
        tracks.append(model.joint_states())
        world.delete("a")
    assert tracks[0] == tracks[1]


def test_what_was_set_survives_the_arrival_of_another_model(world):
    model = world.spawn("a", slider(), Pose())
    model.set_stops("j", -0.1, 0.1)
    model.set_motor("j", 1.0, 50.0)
    model.body.set_link_gravity("s", False)
    world.spawn("b", slider(), Pose((0.0, 5.0, 0.0)))
    assert world.engine._state.model.body_gravcomp[model.body._ids["s"]] == 1.0
    run(world, 50)
    assert model.joint_state("j")[1] == pytest.approx(1.0, abs=1e-3)
    run(world, 500)
    assert model.joint_state("j")[0] == pytest.approx(0.1, abs=0.001)


def test_a_model_that_is_refused_leaves_the_world_as_it_was(world, tmp_path):
    pole = world.spawn("a", parse_urdf(cartpole_urdf()), Pose())
    run(world, 10)
    before = pole.joint_states()
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3 4\n")
    flat = block(geometry=f"<mesh><uri>{tmp_path}/flat.obj</uri></mesh>")
    with refused("can't load the model: ", "flat.obj"):
        world.spawn("b", flat, Pose())
    assert pole.joint_states() == before
    run(world, 10)
    assert list(world.models) == ["a"]


def test_dry_friction_holds_up_to_its_effort_and_brakes_with_it(world):
    model = world.spawn("a", slider(more='<dynamics friction="3"/>'), Pose())
    for force, speed in ((2.9, 0.0), (5.0, (5.0 - 3.0) / 2.0)):
        for _ in range(1000):
            model.body.apply_efforts((force,))
            world.step()
        assert model.joint_state("j")[1] == pytest.approx(speed, abs=1e-3)
    run(world, 500)
    assert model.joint_state("j")[1] == pytest.approx(1.0 - 0.5 * 3.0 / 2.0, abs=2e-3)
    run(world, 500)
    assert model.joint_state("j")[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("mu", "ground", "slides"), [("0.2", 1.0, True), ("5", 0.2, True), ("0.3", 9.0, False)]
)
def test_the_smaller_coefficient_of_friction_counts(world, mu, ground, slides):
    slope = 0.25
    world.set_gravity((9.8 * math.sin(slope), 0.0, -9.8 * math.cos(slope)))
    floor = ground_plane()
    floor.links["link"].collisions = [Shape("plane", mu=ground)]
    world.spawn("floor", floor, Pose())
    model = world.spawn("b", block(mu=mu), Pose((0.0, 0.0, 0.1)))
    run(world, 1000)
    way = 0.5 * 9.8 * (math.sin(slope) - min(float(mu), ground) * math.cos(slope))
    assert model.state()[0].position[0] == pytest.approx(slides * way, abs=0.01)


def test_a_fixed_base_stands_where_it_was_put_also_for_what_falls_on_it(world):
    model = world.spawn("table", block(static=True), Pose())
    model.place(Pose((5.0, 0.0, 1.0)))
    ball = world.spawn("ball", block(), Pose((5.0, 0.0, 1.25)))
    run(world, 500)
    assert model.state()[0].position == (5.0, 0.0, 1.0)
    assert ball.state()[0].position[2] == pytest.approx(1.2, abs=1e-3)


@pytest.mark.parametrize("speed", [math.nan, 1e200, -math.inf])
def test_what_grows_beyond_all_bounds_stops_alone_with_one_warning(
    world, tmp_path, monkeypatch, caplog, speed
):
    monkeypatch.chdir(tmp_path)
    wild = world.spawn("a", slider(), Pose())
    ball = world.spawn("b", block(), Pose((3.0, 0.0, 2.0)))
    run(world, 50)
    wild.body.reset_joint(0, 0.2, speed)
    run(world, 100)
    assert wild.joint_states() == [(0.2, 0.0)]
    assert ball.state()[0].position[2] == pytest.approx(2.0 - 4.9 * 0.15**2, abs=1e-3)
    assert caplog.text.count("huge value in QVEL") == 1
    assert list(tmp_path.iterdir()) == []  # MuJoCo's own log


def test_a_step_as_long_and_gravity_as_strong_as_can_be_leave_numbers(world):
    model = world.spawn("a", parse_urdf(cartpole_urdf()), Pose())
    ball = world.spawn("b", block(), Pose((3.0, 0.0, 2.0)))
    model.body.reset_joint(1, 0.3, 1.0)
    world.set_time_step(10.0)
    world.set_gravity((1e12, 1e12, -1e12))
    run(world, 100)
    numbers = [*sum(model.joint_states(), ()), *sum(ball.state()[0], ()), *sum(ball.state()[1], ())]
    assert all(map(math.isfinite, numbers))
