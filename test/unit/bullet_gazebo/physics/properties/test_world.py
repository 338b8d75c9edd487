"""Gravity, time step and frames of a world."""

import pytest
from support.robots.bodies import BOX, UP, run

from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.world import SolverSettings


def test_gravity_and_time_step_act(world, box):
    world.set_gravity((1.0, 0.0, 0.0))
    world.set_time_step(0.01)
    run(world, 10)
    assert box.state()[1][0] == pytest.approx((0.1, 0.0, 0.0))
    world.set_solver(SolverSettings(iterations=4_000_000_000))  # at most what a step can do
    world.set_solver(SolverSettings(iterations=0))
    world.step()


def test_no_speed_limit_on_a_single_body(world, box):
    world.set_gravity((0.0, 0.0, 0.0))
    box.place(UP, ((1e4, 0.0, 0.0), (0.0, 0.0, 0.0)))
    world.step()
    assert box.state()[1][0] == pytest.approx((1e4, 0.0, 0.0))


def test_collisions_are_frames_but_no_links(world, box):
    assert world.frame("box::body::hull_collision")[0].position == pytest.approx((0.0, 0.0, 51.0))
    assert world.frame("hull_collision") == world.frame("box::body::hull_collision")
    assert list(box.collisions("body")) == ["hull_collision", "body_collision_1"]
    assert world.link("hull_collision") is None
    assert world.link("body") == world.link("box::body") == (box, "body")
    assert world.is_world_frame("map")
    world.spawn("map", parse_urdf(BOX), UP)
    assert not world.is_world_frame("map")
    assert world.frame("map")[0].position == pytest.approx(UP.position)
