"""Height maps: where they are, what rests and rolls on them, what rays meet, and what is refused."""

import math
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.refusals import refused
from support.robots.snippets import ball, collision, sdf, sdf_link
from support.robots.worlds import run

from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.world_file import load_world
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.pictures.visuals import pieces_of
from robot_sim.sensors.rays import RayScene

RADIUS, GRAVITY = 0.2, 9.8
ORIGIN = Pose()
WORLDS = Path(__file__).parents[4] / "worlds"
SIDE = 33
DOWN = np.array([[0.0, 0.0, -1.0]])


@pytest.fixture
def image(tmp_path):
    """Write pixels as a PNG, of 16 bits if they are so many; returns its path."""

    def write(pixels, name="map.png"):
        Image.fromarray(pixels).save(tmp_path / name)
        return tmp_path / name

    return write


def terrain(path, size="20 20 4", more="", static=True, tags=("collision",)):
    shape = f"<geometry><heightmap><uri>file://{path}</uri><size>{size}</size>{more}</heightmap></geometry>"
    shapes = "".join(f'<{tag} name="c">{shape}</{tag}>' for tag in tags)
    return parse_sdf(sdf(f'<link name="l">{shapes}</link>', static=static))


def rolled(world, start, ticks):
    """Where a ball is some time after it was put there."""
    solid = sdf_link("l", more=collision(ball(RADIUS)), moment=0.4 * RADIUS**2)
    thing = world.spawn("ball", parse_sdf(sdf(solid)), Pose(start))
    run(world, ticks)
    return thing.state()[0].position


def ramp():
    """Rises along x, to the last bit of 16."""
    return np.tile(np.linspace(0.0, 65535.0, SIDE).round().astype(np.uint16), (SIDE, 1))


def heights(x, y, pixels, side=20.0, top=4.0):
    """The bilinear surface at places (n,), from the image's rows, of which the first is at the highest y."""
    last = len(pixels) - 1
    column, row = (x / side + 0.5) * last, (0.5 - y / side) * last
    c, r = np.minimum(column.astype(int), last - 1), np.minimum(row.astype(int), last - 1)
    u, v = column - c, row - r
    shares = pixels / pixels.max() * top
    upper = shares[r, c] * (1 - u) + shares[r, c + 1] * u
    lower = shares[r + 1, c] * (1 - u) + shares[r + 1, c + 1] * u
    return upper * (1 - v) + lower * v


def in_triangles(x, y, pixels, side=20.0, top=4.0):
    """The same with two triangles for each cell of four pixels, as without more samples."""
    last = len(pixels) - 1
    column, row = (x / side + 0.5) * last, (y / side + 0.5) * last
    c, r = np.minimum(column.astype(int), last - 1), np.minimum(row.astype(int), last - 1)
    u, v = column - c, row - r
    shares = pixels[::-1] / pixels.max() * top
    low, high = shares[r, c], shares[r + 1, c + 1]
    right, above = shares[r, c + 1], shares[r + 1, c]
    one, other = u * (right - low) + v * (high - right), v * (above - low) + u * (high - above)
    return low + np.where(u > v, one, other)


@pytest.mark.parametrize("bits", [8, 16])
def test_a_ball_rests_in_the_hollow_and_the_images_top_is_at_y(make_world, image, bits):
    """A bowl whose lowest place is right of the image's middle and above it."""
    row, column = np.mgrid[0:SIDE, 0:SIDE]
    bowl = np.maximum(abs(row - 8), abs(column - 24)) / 24.0
    pixels = (bowl * (2**bits - 1)).round().astype(f"uint{bits}")
    world = make_world()
    ground = terrain(image(pixels), more="<sampling>1</sampling>")
    world.spawn("terrain", ground, Pose((0.0, 0.0, 1.0)))
    x, y, z = rolled(world, (4.9, 5.1, 2.0), 4000)
    assert (x, y) == pytest.approx((5.0, 5.0), abs=0.05)
    # Nothing of the terrain is inside of the ball, and something touches it.
    dx, dy = np.mgrid[-RADIUS:RADIUS:201j, -RADIUS:RADIUS:201j].reshape(2, -1)
    within = np.hypot(dx, dy) < RADIUS
    dx, dy = dx[within], dy[within]
    rest = in_triangles(x + dx, y + dy, pixels) + np.sqrt(RADIUS**2 - dx**2 - dy**2)
    assert z == pytest.approx(1.0 + rest.max(), abs=1e-3)


@pytest.mark.parametrize(("level", "height"), [(100, 1.6), (0, 0.0)])
def test_a_ball_on_a_flat_place_is_within_a_millimetre(make_world, image, level, height):
    """A map of zeros is a floor."""
    pixels = np.full((17, 17), level, np.uint8)
    pixels[0, 0], pixels[-1, -1] = 2.5 * level, 0
    world = make_world()
    world.spawn("terrain", terrain(image(pixels)), ORIGIN)
    at = rolled(world, (1.3, -2.1, height + 0.4), 1500)
    assert at == pytest.approx((1.3, -2.1, height + RADIUS), abs=1e-3)


def test_a_ball_rolls_down_a_ramp_as_on_a_plane(make_world, image):
    slope = math.atan2(4.0, 20.0)
    world = make_world(gravity=(0.0, 0.0, -GRAVITY))
    world.spawn("terrain", terrain(image(ramp())), ORIGIN)
    lift = RADIUS / math.cos(slope)
    x, y, z = rolled(world, (5.0, 0.3, 3.0 + lift), 1500)
    way = 0.5 * 5.0 / 7.0 * GRAVITY * math.sin(slope) * 1.5**2
    assert (5.0 - x) / math.cos(slope) == pytest.approx(way, rel=1e-3)
    assert z == pytest.approx(0.2 * (x + 10.0) + lift, abs=1e-3)
    assert y == pytest.approx(0.3, abs=3e-3)


def test_rays_meet_the_bilinear_surface_between_pixels(make_world, image):
    """At the samples, of which a pixel has four; visuals are the same."""
    pixels = np.random.default_rng(1).integers(0, 256, (SIDE, SIDE)).astype(np.uint8)
    world = make_world()
    ground = terrain(image(pixels), more="<sampling>4</sampling><pos>0 0 -1</pos>")
    world.spawn("terrain", ground, Pose((3.0, 0.0, 0.5), from_rpy(0.0, 0.0, math.pi / 2)))
    places = np.random.default_rng(2).integers(0, 4 * (SIDE - 1), (200, 2)) * 20.0 / 128 - 10.0
    scene = RayScene(world)
    for x, y in places:
        # Turned by a quarter, the terrain's x is the world's y.
        met = scene.cast(np.array([3.0 - y, x, 9.0]), DOWN).distances[0]
        wanted = float(heights(np.array([x]), np.array([y]), pixels)[0]) - 0.5
        assert 9.0 - met == pytest.approx(wanted, abs=1e-5)


def test_what_is_seen_is_what_is_touched(image):
    pixels = np.random.default_rng(1).integers(0, 256, (9, 9)).astype(np.uint8)
    (link,) = terrain(image(pixels), tags=("collision", "visual")).links.values()
    (seen,), (touched,) = pieces_of(link.visuals[0]), pieces_of(link.collisions[0])
    np.testing.assert_array_equal(seen.solid.corners, touched.solid.corners)
    assert seen.solid.corners[:, 2].max() == pytest.approx(4.0)


def test_a_terrain_without_static_is_static(make_world, image):
    model = terrain(image(ramp()), static=False)
    assert model.static and any("static" in line for line in model.warnings)
    world = make_world()
    ground = world.spawn("terrain", model, Pose((0.0, 0.0, 5.0)))
    run(world, 100)
    assert ground.state()[0].position == (0.0, 0.0, 5.0)


def huge_png(path, side):
    """A PNG's header and nothing behind it."""

    def chunk(kind, data):
        sum_of_all = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + sum_of_all

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 16, 0, 0, 0, 0))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", b""))
    return path


@pytest.mark.parametrize("case", ["huge", "bomb", "oblong", "even", "dem", "text", "none", "size"])
def test_a_map_that_cannot_be_read_is_one_line(tmp_path, image, case):
    square = np.zeros((5, 5), np.uint8)
    bad = {
        "huge": lambda: (huge_png(tmp_path / "a.png", 8193), "8193 x 8193 pixels"),
        "bomb": lambda: (huge_png(tmp_path / "a.png", 20000), "too many pixels; a height map has"),
        "oblong": lambda: (image(np.zeros((5, 9), np.uint8)), "9 x 5 pixels"),
        "even": lambda: (image(np.zeros((4, 4), np.uint8)), "(2^n + 1) x (2^n + 1)"),
        "dem": lambda: (image(square, "a.tif"), "only .png, .jpg, .jpeg files are read"),
        "none": lambda: (tmp_path / "no.png", "is not found"),
        "size": lambda: (image(square), "above 0"),
    }
    (tmp_path / "text.png").write_text("no image")
    path, fault = bad[case]() if case != "text" else (tmp_path / "text.png", "can't be read")
    with refused("link 'l', collision 'c'", fault):
        terrain(path, size="0 1 1" if case == "size" else "1 1 1")


def test_an_image_is_no_mesh(image):
    shape = collision(f"<mesh><uri>file://{image(ramp())}</uri></mesh>")
    with refused("only .stl, .dae, .obj files"):
        parse_sdf(sdf(sdf_link("l", more=shape)))


def test_a_rover_drives_over_hills_and_keeps_to_them(make_world):
    """`worlds/hills.world`: over a slope, its wheels neither sink nor fly."""
    hills = load_world(WORLDS / "hills.world", Resources())
    assert hills.warnings == []
    world = make_world()
    for name, each in hills.models.items():
        world.spawn(name, each, each.initial_pose)
    pixels, rover = np.asarray(Image.open(WORLDS / "hills.png")), world.models["rover"]
    for side in ("left", "right"):
        rover.set_motor(side, 6.0, 5.0)
    for _ in range(12):
        run(world, 500)
        for wheel in ("left_wheel", "right_wheel"):
            x, y, z = rover.link_state(wheel)[0].position
            ground = float(heights(np.array([x]), np.array([y]), pixels, 16.0, 1.3)[0])
            assert 0.098 < z - ground < 0.12
    assert rover.state()[0].position[0] > 2.0 and ground > 0.2
