"""Scans of lasers (docs/contract/sensors.md 2)."""

import math

import numpy as np
import pytest
from support.refusals import refused

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.sensors.laser import Laser
from robot_sim.sensors.noise import generator
from robot_sim.sensors.rays import RayScene

LASER = """<sdf version="1.6"><model name="m"><link name="link"><inertial><mass>1</mass></inertial>
<sensor name="eye" type="{kind}"><update_rate>5</update_rate><ray><scan>
<horizontal><samples>{samples}</samples><resolution>{resolution}</resolution>
<min_angle>{low}</min_angle><max_angle>{high}</max_angle></horizontal>
<vertical><samples>{rows}</samples><min_angle>{down}</min_angle><max_angle>{up}</max_angle></vertical></scan>
<range><min>{near}</min><max>{far}</max></range>{noise}</ray></sensor></link></model></sdf>"""
DEFAULTS = {
    "kind": "ray", "samples": 360, "resolution": 1, "low": 0.0, "high": 2.0 * math.pi * 359 / 360, "rows": 1,
    "down": 0.0, "up": 0.0, "near": 0.1, "far": 8.0, "noise": "",
}  # fmt: skip
EYE = Pose((0.0, 0.0, 0.5))


def laser(**options):
    [sensor] = parse_sdf(LASER.format(**{**DEFAULTS, **options})).sensors
    return Laser(sensor)


def scan(laser, world, pose=EYE, key=0):
    scene = RayScene(world, laser.sees_visuals)
    return laser.measure(scene, pose, 0.0, generator(0, key))


def test_each_ray_in_a_room_is_within_a_millimetre_and_a_door_is_infinite(world, put):
    for name, x, y, width, depth in (
        ("left", 0.0, 1.05, 2.0, 0.1), ("right", 0.0, -1.05, 2.0, 0.1), ("back", -1.05, 0.0, 0.1, 2.2),
        ("front", 1.05, 0.6, 0.1, 0.8), ("front2", 1.05, -0.6, 0.1, 0.8),
    ):  # fmt: skip
        put(name, "box", (width, depth, 1.0), Pose((x, y, 0.5)), retro=3.0 * (name == "left"))
    eye = laser()
    found = scan(eye, world).ranges.ravel()
    for angle, distance in zip(eye.horizontal.angles(360), found, strict=True):
        if abs(math.sin(angle)) < 0.19 and math.cos(angle) > 0.0:  # the door is 0.4 m wide
            assert distance == math.inf
        elif not (abs(math.tan(angle)) < 0.21 and math.cos(angle) > 0.0):  # its frame
            wall = 1.0 / max(abs(math.cos(angle)), abs(math.sin(angle)))
            assert distance == pytest.approx(wall, abs=1e-3)
    retro = scan(laser(samples=4, high=1.5 * math.pi), world).intensities
    assert retro.tolist() == [[0.0, 3.0, 0.0, 0.0]]  # of the wall at the left


def test_only_collisions_are_seen_by_a_laser_and_only_visuals_by_a_rendered_one(world, put):
    put("goal", "box", (1.0, 1.0, 1.0), Pose((2.0, 0.0, 0.5)), tag="visual")
    put("wall", "box", (1.0, 1.0, 1.0), Pose((-2.0, 0.0, 0.5)))
    solid = scan(laser(samples=2, high=math.pi), world).ranges
    assert solid.tolist() == [[math.inf, pytest.approx(1.5)]]
    seen = scan(laser(kind="gpu_ray", samples=2, high=math.pi), world).ranges
    assert seen.tolist() == [[pytest.approx(1.5), math.inf]]


def test_rows_begin_with_the_lowest_one_and_a_tilted_sensor_turns_its_rays(world):
    down = scan(laser(samples=1, rows=3, down=-0.5, up=0.5, low=0.0, high=0.0), world).ranges[:, 0]
    assert down.tolist() == [pytest.approx(0.5 / math.sin(0.5)), math.inf, math.inf]
    pose = Pose((0.0, 0.0, 0.5), from_rpy(0.0, math.pi / 2, 0.0))  # +x looks down
    assert scan(laser(samples=1, high=0.0), world, pose).ranges[0, 0] == pytest.approx(0.5)


def test_a_coarser_resolution_interpolates(world, put):
    put("wall", "box", (0.1, 20.0, 20.0), Pose((2.05, 0.0, 0.0)))
    options = {"low": -0.4, "high": 0.4, "samples": 5}
    eye = laser(**options, resolution=0.6)
    assert eye.horizontal.readings == 3
    fine, coarse = scan(laser(**options), world).ranges[0], scan(eye, world).ranges[0]
    np.testing.assert_allclose(coarse, fine[[0, 2, 4]])
    doubled = scan(laser(**options, resolution=1.8), world).ranges[0]
    np.testing.assert_allclose(doubled[1::2], (fine[:-1] + fine[1:]) / 2)


NOISE = "<noise><type>gaussian</type><mean>0.02</mean><stddev>0.05</stddev></noise>"


def test_noise_has_its_mean_and_deviation_and_stays_within_range(world, put):
    put("wall", "box", (0.1, 20.0, 20.0), Pose((2.05, 0.0, 0.0)))
    eye = laser(low=-0.01, high=0.01, samples=100, noise=NOISE)
    exact = scan(laser(low=-0.01, high=0.01, samples=100), world).ranges
    errors = np.array([scan(eye, world, key=key).ranges - exact for key in range(100)])
    count = errors.size
    assert abs(errors.mean() - 0.02) < 3 * 0.05 / math.sqrt(count)
    assert abs(errors.std() - 0.05) < 3 * 0.05 / math.sqrt(2 * count)
    close = laser(samples=50, low=-0.01, high=0.01, far=2.01, noise=NOISE)
    assert scan(close, world).ranges.max() <= 2.01


def test_noise_depends_on_its_key_alone_and_what_is_not_met_has_none(world, put):
    eye = laser(low=-0.1, high=0.1, samples=9, noise=NOISE)
    assert scan(eye, world).ranges.tolist() == [[math.inf] * 9]
    put("wall", "box", (0.1, 20.0, 20.0), Pose((2.05, 0.0, 0.0)))
    first, second = (scan(eye, world, key=key).ranges for key in (1, 2))
    assert (first != second).any()
    assert scan(eye, world, key=1).ranges.tobytes() == first.tobytes()


@pytest.mark.parametrize(
    "options",
    [
        {"samples": 0}, {"samples": 1.5}, {"samples": 10**7}, {"samples": 4000, "rows": 4000},
        {"near": -1}, {"near": 2, "far": 1}, {"low": 1, "high": -1}, {"high": 1e9}, {"resolution": 0},
    ],
)  # fmt: skip
def test_an_impossible_laser_is_refused_in_one_line(options):
    with refused("sensor 'eye'"):
        laser(**options)


def test_a_number_that_is_none_is_named():
    with refused("<samples>"):
        laser(samples="many")
