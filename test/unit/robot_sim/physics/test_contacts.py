"""Contacts on each engine, compared with statics, with sliding friction, and with ODE's `max_vel`."""

import itertools
import math

import numpy as np
import pytest
from support.mutations.mesh_files import obj
from support.robots.snippets import box, collision, joint, link, robot, sdf, sdf_link
from support.robots.worlds import run as step

from robot_sim.physics.description import Inertia, Link, ModelDescription, Shape
from robot_sim.physics.engines.bullet_engine import BulletEngine
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import SolverSettings

GRAVITY = 9.8  # [m/s²]
MAX_VEL = 0.01  # [m/s]; ODE's default
SIDE = 0.2  # [m] of what is put into the ground
SHAPES = {"box": (SIDE, SIDE, SIDE), "sphere": (SIDE / 2,), "cylinder": (SIDE / 2, SIDE)}


def solid(kind, size, mass=1.0, mu=1.0, static=False, max_vel=MAX_VEL):
    """A model of one shape, with the inertia of a box."""
    x, y, z = size if len(size) == 3 else (SIDE, SIDE, SIDE)
    inertia = Inertia(mass, ixx=mass * (y**2 + z**2) / 12, iyy=mass * (x**2 + z**2) / 12,
                      izz=mass * (x**2 + y**2) / 12)  # fmt: skip
    shape = Shape(kind, size, name="shape", mu=mu, max_vel=max_vel)
    link = Link("link", inertia, [shape])
    return ModelDescription("solid", {"link": link}, {}, root="link", static=static)


def run(world, model, steps):
    """Heights [m] and upward speeds [m/s] of a model after each step."""
    states = []
    for _ in range(steps):
        world.step()
        pose, (linear, _) = model.state()
        states.append((pose.position[2], linear[2]))
    heights, speeds = np.array(states).T
    return heights, speeds


def carried(world, model, steps=200):
    """The force [N] that each link of a model bears upwards on average."""
    loads = {}
    for _ in range(steps):
        world.step()
        for contact in world.contacts():
            for side, sign in ((contact.first, 1.0), (contact.second, -1.0)):
                if side.body is model.body:
                    share = sign * contact.force[2] / steps
                    loads[side.link] = loads.get(side.link, 0.0) + share
    return loads


@pytest.mark.parametrize("kind", list(SHAPES))
@pytest.mark.parametrize("depth", [0.001, 0.01, 0.03, 0.2])
def test_what_is_put_into_the_ground_comes_out_at_max_vel(world, kind, depth):
    model = world.spawn("solid", solid(kind, SHAPES[kind]), Pose((0.0, 0.0, SIDE / 2 - depth)))
    seconds = 2.5 if depth > 0.1 else 0.5 + 1.05 * depth / MAX_VEL
    heights, speeds = run(world, model, round(1000 * seconds))
    assert speeds.max() < 1.05 * MAX_VEL
    if depth > 0.1:  # it would take 20 s; that it comes steadily is enough
        assert heights[-1] - heights[999] == pytest.approx(1.5 * MAX_VEL, rel=0.05)
        return
    assert heights[-1] == pytest.approx(SIDE / 2, abs=1e-4)
    assert heights.max() < SIDE / 2 + 1e-4


@pytest.mark.parametrize("kind", list(SHAPES))
def test_what_rests_and_is_put_into_the_ground_comes_out_at_max_vel(world, kind):
    """Points of the contacts that it had would push it as a spring."""
    model = world.spawn("solid", solid(kind, SHAPES[kind]), Pose((0.0, 0.0, SIDE / 2)))
    run(world, model, 500)
    for _ in range(2):
        model.place(Pose((0.0, 0.0, SIDE / 2 - 0.02)))
        heights, speeds = run(world, model, 1990)
        assert speeds.max() < 1.05 * MAX_VEL
    heights, speeds = run(world, model, 500)
    assert heights[-1] == pytest.approx(SIDE / 2, abs=1e-4)


def urdf(shape, more=""):
    """A link of 1 kg with one shape."""
    touching = f"<collision><geometry>{shape}</geometry></collision>"
    return parse_urdf(robot(link("link", moment=0.01, more=touching), more))


def test_a_mesh_comes_out_of_the_ground_at_max_vel(world, tmp_path):
    path = tmp_path / "box.obj"
    path.write_bytes(obj())
    description = urdf(f'<mesh filename="file://{path}" scale="0.1 0.1 0.1"/>')
    model = world.spawn("box", description, Pose((0.0, 0.0, 0.08)))
    heights, speeds = run(world, model, 3000)
    assert speeds.max() < 1.05 * MAX_VEL
    assert heights[-1] == pytest.approx(0.1, abs=0.0012)  # PyBullet's margin around meshes


def test_two_models_that_overlap_separate_at_max_vel(world):
    below = world.spawn("below", solid("box", (0.4, 0.4, 0.2), mass=3.0), Pose((0.0, 0.0, 0.1)))
    above = world.spawn("above", solid("box", SHAPES["box"]), Pose((0.0, 0.0, 0.26)))
    heights, speeds = run(world, above, 5000)
    assert speeds.max() < 1.5 * MAX_VEL
    assert heights[-1] == pytest.approx(0.3, abs=5e-4)
    assert below.state()[0].position[2] == pytest.approx(0.1, abs=5e-4)


@pytest.mark.parametrize(("text", "read"), [("0.1", 0.1), ("", 0.01), ("0.0", 0.0)])
def test_max_vel_is_that_of_the_file(world, text, read):
    ode = f"<ode><max_vel>{text}</max_vel></ode>"
    surface = f"<surface><contact>{ode}</contact></surface>" * bool(text)
    shape = collision(box("0.2 0.2 0.2"), surface)
    extension = f'<gazebo reference="link"><maxVel>{text}</maxVel></gazebo>' * bool(text)
    descriptions = [
        parse_sdf(sdf(sdf_link("link", more=shape, moment=0.01))),
        urdf('<box size="0.2 0.2 0.2"/>', extension),
    ]
    for place, description in enumerate(descriptions):
        # The ground's own would bound it, too.
        ground = solid("box", (1.0, 1.0, 1.0), static=True, max_vel=1.0)
        world.spawn(f"ground{place}", ground, Pose((5.0 * place + 5.0, 0.0, 0.0)))
        model = world.spawn(f"box{place}", description, Pose((5.0 * place + 5.0, 0.0, 0.55)))
        heights, speeds = run(world, model, 300)
        assert speeds.max() == pytest.approx(read, abs=max(0.1 * read, 5e-4))


def test_the_worlds_fastest_correction_bounds_every_contact(world):
    world.set_solver(SolverSettings(contact_max_correcting_vel=0.002))
    model = world.spawn("solid", solid("box", SHAPES["box"]), Pose((0.0, 0.0, 0.05)))
    assert run(world, model, 500)[1].max() == pytest.approx(0.002, rel=0.1)


def hop(world):
    """How far [m] what slides at 3 m/s may leave the ground: its friction lifts it a little in MuJoCo."""
    return 0.0002 if isinstance(world.engine, BulletEngine) else 0.0005


def part(name, shape, mass, place="0 0 0", turn="0 0 0", kind="fixed", smooth=False):
    """A link with its joint to the base, and a friction of zero for one that is smooth."""
    limit = 'effort="10" velocity="100"'
    held = joint(f"{name}_joint", kind, "base", name, place, axis="0 1 0", limit=limit)
    friction = f'<gazebo reference="{name}"><mu1>0</mu1></gazebo>'
    # Fixed joints are kept, so that contacts are told apart by link.
    kept = f'<gazebo reference="{name}_joint"><preserveFixedJoint>1</preserveFixedJoint></gazebo>'
    touching = f'<collision><origin rpy="{turn}"/><geometry>{shape}</geometry></collision>'
    body = link(name, mass, moment=0.01 * mass, more=touching)
    return body + (held + kept) * (name != "base") + friction * smooth


def vehicle():
    """Two wheels of 5 cm, and smooth balls before and behind, whose lowest points are in one plane."""
    wheel, ball = '<cylinder radius="0.05" length="0.03"/>', '<sphere radius="0.02"/>'
    turn = f"{math.pi / 2} 0 0"
    parts = [
        part("base", '<box size="0.3 0.2 0.05"/>', 2.0),
        part("left", wheel, 0.1, "0 0.12 -0.03", turn, "continuous"),
        part("right", wheel, 0.1, "0 -0.12 -0.03", turn, "continuous"),
        part("front", ball, 0.1, "0.12 0 -0.06", smooth=True),
        part("back", ball, 0.1, "-0.12 0 -0.06", smooth=True),
    ]
    return parse_urdf(robot(*parts))


def test_wheels_between_two_casters_carry_and_drive(world):
    model = world.spawn("vehicle", vehicle(), Pose((0.0, 0.0, 0.08)))
    step(world, 500)
    loads = carried(world, model)
    weight = 2.4 * GRAVITY
    assert sum(loads.values()) == pytest.approx(weight, rel=0.01)
    assert min(loads["left"], loads["right"]) > 0.15 * weight
    start = model.state()[0].position[0]
    for index in (0, 1):
        model.body.set_motor(index, 0.2 / 0.05, 5.0)
    heights, _ = run(world, model, 5000)
    assert model.state()[0].position[0] - start == pytest.approx(1.0, abs=0.02)
    assert np.ptp(heights[500:]) < 20e-6


def test_a_vehicle_put_into_the_ground_climbs_out_while_its_wheels_turn(world):
    model = world.spawn("vehicle", vehicle(), Pose((0.0, 0.0, 0.05)))  # 3 cm deep
    for index in (0, 1):
        model.body.set_motor(index, 0.2 / 0.05, 5.0)
    heights, speeds = run(world, model, 4500)
    assert speeds.max() < 8.0 * MAX_VEL
    assert (heights - (0.05 + MAX_VEL * 0.001 * np.arange(4500))).max() < 0.01
    assert heights[-1] == pytest.approx(0.08, abs=2e-4)


def table(feet):
    """A top of 8 kg on balls of 0.5 kg at these places (x, y) [m]."""
    parts = [part("base", '<box size="1.2 0.8 0.04"/>', 8.0)]
    for number, (x, y) in enumerate(feet):
        parts.append(part(f"leg{number}", '<sphere radius="0.02"/>', 0.5, f"{x} {y} -0.4"))
    return parse_urdf(robot(*parts))


@pytest.mark.parametrize(
    ("places", "close"),
    [
        ([(0.5, 0.3), (-0.2, -0.3), (-0.5, 0.2)], {"rel": 0.03, "abs": 1.0}),
        # Statics leaves it open: the least forces are a quarter each.
        ([(0.5, 0.3), (0.5, -0.3), (-0.5, -0.3), (-0.5, 0.3)], {"rel": 0.2}),
    ],
)
def test_a_tables_legs_carry_what_statics_says(world, places, close):
    model = world.spawn("table", table(places), Pose((0.0, 0.0, 0.42)))
    step(world, 1000)
    loads = carried(world, model)
    # Forces add up to the weight, and so do their torques about the origin.
    (x, y) = np.array(places).T
    weights = GRAVITY * np.array([8.0 + 0.5 * len(x), 0.5 * x.sum(), 0.5 * y.sum()])
    theory = np.linalg.lstsq(np.array([np.ones(len(x)), x, y]), weights, rcond=None)[0]
    assert [loads[f"leg{n}"] for n in range(len(x))] == pytest.approx(list(theory), **close)


@pytest.mark.parametrize("mu", [0.3, 0.5, 0.8])
def test_what_slides_stays_on_the_ground_and_stops_where_friction_says(world, mu):
    model = world.spawn("solid", solid("box", SHAPES["box"], mu=mu), Pose((0.0, 0.0, SIDE / 2)))
    run(world, model, 500)
    (start, _, rest) = model.state()[0].position
    model.body.set_base_twist(((3.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    heights, _ = run(world, model, 2000)
    assert rest - 0.001 < heights.min() <= heights.max() < rest + hop(world)
    way = model.state()[0].position[0] - start
    assert way == pytest.approx(3.0**2 / (2.0 * mu * GRAVITY), rel=0.01)


@pytest.mark.parametrize("mu", [0.3, 0.5])
def test_a_slab_slides_down_a_slope_at_the_acceleration_of_theory(make_world, mu):
    world = make_world()
    angle = math.atan(mu) + math.radians(15.0)
    down, up = (math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))
    turn = (0.0, math.sin(angle / 2), 0.0, math.cos(angle / 2))
    ground = solid("box", (40.0, 4.0, 1.0), static=True)
    world.spawn("ground", ground, Pose((-0.5 * up[0], 0.0, -0.5 * up[1]), turn))
    slab = solid("box", (0.3, 0.3, 0.1), mu=mu)
    model = world.spawn("slab", slab, Pose((0.05 * up[0], 0.0, 0.05 * up[1]), turn))
    above = []
    for _ in range(1500):
        world.step()
        x, _, z = model.state()[0].position
        above.append(x * up[0] + z * up[1] - 0.05)
    way = x * down[0] + z * down[1]
    theory = 0.5 * GRAVITY * (math.sin(angle) - mu * math.cos(angle)) * 1.5**2
    assert way == pytest.approx(theory, rel=0.01)
    assert -0.001 < min(above) <= max(above) < 2.0 * hop(world)


@pytest.mark.parametrize("kind", list(SHAPES))
def test_what_falls_doesnt_rebound(world, kind):
    model = world.spawn("solid", solid(kind, SHAPES[kind]), Pose((0.0, 0.0, SIDE / 2 + 0.5)))
    heights, _ = run(world, model, 1500)
    landed = int(np.argmax(heights < SIDE / 2 + 1e-4))
    assert heights[landed:].max() < SIDE / 2 + 1e-4
    # MuJoCo's contacts take 10 ms to stop it.
    assert heights.min() > SIDE / 2 - (0.001 if isinstance(world.engine, BulletEngine) else 0.012)


@pytest.mark.parametrize("masses", [(1.0, 2.0, 3.0, 4.0, 5.0), (1.0, 50.0)])
def test_boxes_on_each_other_stand_and_sink_less_than_a_millimetre(world, masses):
    boxes = [
        world.spawn(f"box{n}", solid("box", SHAPES["box"], mass), Pose((0.0, 0.0, 0.1 + 0.2 * n)))
        for n, mass in enumerate(masses)
    ]
    step(world, 4000)
    for number, each in enumerate(boxes):
        (x, y, z) = each.state()[0].position
        assert z == pytest.approx(0.1 + 0.2 * number, abs=0.001)
        assert math.hypot(x, y) < 0.001


def test_another_mass_stands_as_high(world):
    model = world.spawn("solid", solid("box", SHAPES["box"]), Pose((0.0, 0.0, 0.1)))
    world.set_inertia(model, "link", Inertia(500.0, ixx=3.3, iyy=3.3, izz=3.3))
    assert run(world, model, 2000)[0][-1] == pytest.approx(0.1, abs=2e-4)


def fastest(world, model, steps):
    """A model's highest speed [m/s] within some steps."""
    speeds = []
    for _ in range(steps):
        world.step()
        speeds.append(math.hypot(*model.state()[1][0]))
    return max(speeds)


@pytest.mark.parametrize("speed", [0.5, 3.0])
@pytest.mark.parametrize("effort", [0.1, 1.0])
def test_a_wall_throws_nothing_back_faster_than_it_came(world, speed, effort):
    """Wheels as light as real ones turn on against the wall, and climb it as far as their motors allow."""
    wall = solid("box", (0.2, 4.0, 2.0), static=True)
    world.spawn("wall", wall, Pose((1.0, 0.0, 1.0)))
    turn = f"{math.pi / 2} 0 0"
    rim = '<cylinder radius="0.05" length="0.03"/>'
    wheels = "".join(
        part(f"w{number}", rim, 0.1, f"{x} {y} -0.03", turn, "continuous")
        for number, (x, y) in enumerate(itertools.product((0.15, -0.15), (0.12, -0.12)))
    ).replace('"0.001"', '"0.000125"')  # of a disc: m r² / 2
    text = robot(part("base", '<box size="0.2 0.2 0.05"/>', 2.0), wheels)
    model = world.spawn("vehicle", parse_urdf(text), Pose((0.3, 0.0, 0.08)))
    for index in range(4):
        model.body.set_motor(index, speed / 0.05, effort)
    assert fastest(world, model, 3000) < speed + 2.0  # it falls from where it has climbed


@pytest.mark.parametrize("kind", list(SHAPES))
def test_what_is_put_into_a_wall_from_the_side_comes_out_slowly(world, kind):
    """What rolls out on the ground turns against the wall: that may not push it."""
    world.spawn("wall", solid("box", (0.2, 4.0, 2.0), static=True), Pose((1.0, 0.0, 1.0)))
    model = world.spawn("solid", solid(kind, SHAPES[kind]), Pose((0.83, 0.0, SIDE / 2)))
    assert fastest(world, model, 3500) < 3.0 * MAX_VEL
    assert model.state()[0].position[0] == pytest.approx(0.9 - SIDE / 2, abs=0.02)
