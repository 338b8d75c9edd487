"""SDF beyond box, ball and cylinder: polylines, seen planes, capsules, ellipsoids; and Gazebo's materials."""

import math

import numpy as np
import pytest
from support.refusals import refused
from support.robots.snippets import ball, box, link, robot, sdf, sdf_link
from support.robots.worlds import run

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.pictures.visuals import pieces_of, solid_of, visible_model, visible_shapes
from robot_sim.sensors.rays import RayScene

DOWN = np.array([[0.0, 0.0, -1.0]])
RADIUS = 0.1
BALL = ball(RADIUS)


def outline(points, height=0.5):
    corners = "".join(f"<point>{x} {y}</point>" for x, y in points)
    return f"<polyline>{corners}<height>{height}</height></polyline>"


def square(half):
    return [(-half, -half), (half, -half), (half, half), (-half, half)]


L_SHAPE = [(0, 0), (1, 0), (1, 0.2), (0.2, 0.2), (0.2, 1), (0, 1)]


def model(geometry, static=False, tags=("collision",)):
    shapes = "".join(f'<{tag} name="c"><geometry>{geometry}</geometry></{tag}>' for tag in tags)
    return parse_sdf(sdf(sdf_link("l", more=shapes), static=static))


def dropped(world, at, geometry=BALL, name="ball"):
    """Spawns a thing and returns where it comes to rest."""
    thing = world.spawn(name, model(geometry), Pose(at))
    run(world, 2500)
    return thing.state()[0].position


@pytest.mark.parametrize("static", [True, False])
def test_a_concave_polyline_is_solid_where_it_says(make_world, static):
    """A ball falls into the notch of an L, and stays on its arm."""
    world = make_world(ground=True)
    world.spawn("l", model(outline(L_SHAPE), static), Pose())
    run(world, 200)
    assert dropped(world, (0.6, 0.6, 1.0))[2] == pytest.approx(RADIUS, abs=2e-3)
    world.delete("ball")
    assert dropped(world, (0.1, 0.6, 1.0))[2] == pytest.approx(0.5 + RADIUS, abs=2e-3)


def test_a_second_polyline_is_a_hole(make_world):
    world = make_world(ground=True)
    outlines = outline(square(0.5)) + outline(square(0.25))
    frame = model(outlines, static=True, tags=("collision", "visual"))
    world.spawn("frame", frame, Pose())
    for visuals in (False, True):
        scene = RayScene(world, visuals)
        found = [scene.cast(np.array([x, 0.0, 2.0]), DOWN).distances[0] for x in (0.0, 0.4)]
        assert found == pytest.approx([2.0, 1.5], abs=1e-5)
    assert dropped(world, (0.0, 0.0, 1.0))[2] == pytest.approx(RADIUS, abs=2e-3)


def test_a_convex_polyline_is_one_hull():
    (shape,) = model(outline([(0, 0), (1, 0), (0, 1)])).links["l"].collisions
    assert len(shape.solid.hulls) == 1 and not shape.solid.in_pieces
    assert solid_of(shape).corners.max() == 1.0


@pytest.mark.parametrize(
    ("geometry", "fault"),
    [
        (outline([(0, 0), (1, 0)]), "collision 'c', polyline: its points enclose no area"),
        (outline(L_SHAPE, height=0), "sizes must be above 0"),
        ("<polyline><point>0</point></polyline>", "polyline: <point> must hold 2 numbers"),
        ("<capsule><radius>-1</radius></capsule>", "capsule: sizes must be above 0"),
        ("<ellipsoid><radii>1 1</radii></ellipsoid>", "ellipsoid: <radii> must hold 3 numbers"),
    ],
)  # fmt: skip
def test_a_fault_in_a_shape_is_one_line(geometry, fault):
    with refused(fault):
        model(geometry)


@pytest.mark.parametrize(
    ("shape", "middle", "x", "top"),
    [
        ("<capsule><radius>0.1</radius><length>0.4</length></capsule>",
         0.3, 0.05, 0.5 + math.sqrt(0.01 - 0.05**2)),
        ("<ellipsoid><radii>0.4 0.3 0.1</radii></ellipsoid>", 0.1, 0.2, 0.1 + 0.1 * math.sqrt(0.75)),
    ],
)  # fmt: skip
def test_a_capsule_stands_on_its_balls_and_an_ellipsoid_lies(make_world, shape, middle, x, top):
    world = make_world(ground=True)
    assert dropped(world, (0.0, 0.0, middle), shape, "it")[2] == pytest.approx(middle, abs=2e-3)
    met = RayScene(world).cast(np.array([x, 0.0, 2.0]), DOWN).distances[0]
    assert 2.0 - met == pytest.approx(top, abs=3e-3)


def test_a_plane_that_is_seen_has_its_size(make_world):
    plane = "<plane><normal>1 0 0</normal><size>2 4</size></plane>"
    seen = model(plane, static=True, tags=("visual",))
    ((_, shape),) = visible_shapes(seen)
    (piece,) = pieces_of(shape)
    assert np.ptp(piece.solid.corners, axis=0) == pytest.approx((2.0, 4.0, 0.001))
    world = make_world()
    world.spawn("wall", seen, Pose((3.0, 0.0, 0.0)))
    forward = np.array([[1.0, 0.0, 0.0]])
    scene = RayScene(world, visuals=True)
    assert scene.cast(np.array([0.0, 0.9, 1.9]), forward).distances[0] == math.inf
    met = scene.cast(np.array([5.0, 1.9, 0.9]), -forward)
    assert met.distances[0] == pytest.approx(2.0, abs=1e-6)
    assert RayScene(world).cast(np.array([5.0, 0.0, 0.0]), -forward).distances[0] == math.inf


def test_a_plane_that_collides_has_no_end_and_is_seen_once(make_world):
    plane = "<plane><size>2 2</size></plane>"
    ground = model(plane, static=True, tags=("collision", "visual"))
    assert visible_shapes(ground) == []
    [seen] = visible_model(ground, 1, "m", ["l"], [], False).links[0].visuals
    assert seen.kind == "plane"
    world = make_world()
    world.spawn("ground", ground, Pose())
    assert dropped(world, (30.0, 0.0, 0.3))[2] == pytest.approx(RADIUS, abs=1e-3)


@pytest.mark.parametrize("tag", ["collision", "visual"])
@pytest.mark.parametrize("geometry", ["image", "cone"])
def test_another_geometry_is_a_warning(tag, geometry):
    found = model(f"<{geometry}/>", tags=(tag,))
    assert found.links["l"].collisions == found.links["l"].visuals == []
    told = f"link 'l', {tag} 'c': geometry <{geometry}> is not simulated; it is left out"
    assert found.warnings == [told]


RED, GREEN, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)
UNKNOWN = "the colour of material 'mine/Own' is not known"


def seen_in_sdf(*materials):
    shape = f"<geometry>{box('1 1 1')}</geometry>"
    visuals = "".join(
        f'<visual name="{number}">{shape}<material>{each}</material></visual>'
        for number, each in enumerate(materials)
    )
    model = parse_sdf(sdf(sdf_link("l", more=visuals)))
    return [shape.rgba for shape in model.links["l"].visuals], model.warnings


def script(name):
    uri = "<uri>file://media/materials/scripts/gazebo.material</uri>"
    return f"<script>{uri}<name>{name}</name></script>"


def seen_in_urdf(*blocks):
    shape = '<geometry><box size="1 1 1"/></geometry>'
    blue = '<material name="b"><color rgba="0 0 1 1"/></material>'
    visuals = f"<visual>{shape}{blue}</visual><visual>{shape}</visual>"
    model = parse_urdf(robot(link("l", more=visuals), *blocks))
    return [shape.rgba for shape in model.links["l"].visuals], model.warnings


@pytest.mark.parametrize(
    ("name", "rgba"),
    [
        ("Gazebo/Red", RED),
        ("Gazebo/Green", GREEN),
        ("Gazebo/SkyBlue", BLUE),
        ("Gazebo/DarkGrey", (0.175, 0.175, 0.175, 1.0)),
        ("Gazebo/BlueTransparent", (0.0, 0.0, 1.0, 0.5)),
    ],
)
def test_a_material_of_gazebos_has_its_colour(name, rgba):
    assert seen_in_sdf(script(name)) == ([rgba], [])
    block = f'<gazebo reference="l"><material>{name}</material></gazebo>'
    assert seen_in_urdf(block) == ([rgba, rgba], [])


def test_a_colour_goes_before_its_script_the_last_block_counts_and_may_have_an_attribute():
    assert seen_in_sdf(script("Gazebo/Red") + "<diffuse>0 1 0 1</diffuse>") == ([GREEN], [])
    red, green = "<material>Gazebo/Red</material>", '<material value=" Gazebo/Green "/>'
    blocks = [f'<gazebo reference="l">{each}</gazebo>' for each in (red, green)]
    assert seen_in_urdf(*blocks) == ([GREEN, GREEN], [])


def test_an_unknown_material_leaves_the_colour_and_is_one_warning():
    assert seen_in_sdf(script("mine/Own"), script("mine/Own")) == ([None, None], [UNKNOWN])
    block = '<gazebo reference="l"><material>mine/Own</material></gazebo>'
    assert seen_in_urdf(block) == ([BLUE, None], [UNKNOWN])
