"""Links of two models that are fixed to each other while the world runs."""

import math

import pytest
from support.robots.grippers import cube, gripper
from support.robots.worlds import begin_anew, run

from robot_sim.physics.description import Inertia
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.model import AT_REST
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.simulator import Simulator

PLACE = Pose((0.12, 0.03, 0.1), from_rpy(0.3, -0.4, 1.0))


def pair(world, place=PLACE):
    """A gripper with its lift at 0.1 m, and a cube somewhere, attached to its lift."""
    robot = world.spawn("gripper", parse_urdf(gripper()), Pose())
    robot.set_joint_positions({"lift": 0.1})
    robot.set_motor("lift", 0.0, 1e4)
    box = world.spawn("cube", parse_urdf(cube()), place)
    return robot, box, world.attach((robot, "lift_link"), (box, "cube_link"))


def between(robot, box):
    return box.link_state("cube_link")[0].relative_to(robot.link_state("lift_link")[0])


def near(pose, other, most=1e-4):
    """Whether two poses differ by less than `most` [m, rad / 2]."""
    gap = pose.relative_to(other)
    return max(map(abs, (*gap.position, *gap.orientation[:3]))) < most


def test_what_is_attached_goes_along_and_a_motor_bears_its_weight(world):
    robot, box, _ = pair(world)
    before = between(robot, box)
    run(world, 500)
    assert near(between(robot, box), before)
    robot.set_motor("lift", 0.2, 1e4)
    run(world, 1000)
    assert robot.joint_state("lift")[0] > 0.29
    assert near(between(robot, box), before)
    robot.set_motor("lift", 0.0, 1e4)
    run(world, 100)
    weight = (1.0 + 0.1 + 0.05) * 9.8
    for most, holds in ((1.01 * weight, True), (0.99 * weight, False)):
        robot.set_motor("lift", 0.0, most)
        before = robot.joint_state("lift")[0]
        run(world, 500)
        assert (abs(robot.joint_state("lift")[0] - before) < 1e-4) == holds


def test_attached_links_do_not_collide_and_detached_ones_do_again(world):
    robot = world.spawn("gripper", parse_urdf(gripper()), Pose((0.0, 0.0, 0.2)))
    robot.set_motor("lift", 0.0, 1e4)
    box = world.spawn("cube", parse_urdf(cube()), Pose((0.0, 0.0, 0.53)))  # 5 mm into the lift
    made = world.attach((robot, "lift_link"), (box, "cube_link"))
    run(world, 100)
    assert not world.engine.contacts()
    world.detach(made)
    run(world, 700)  # contacts end an overlap at 0.01 m/s
    assert world.engine.contacts()
    assert box.state()[0].position[2] > 0.534


def test_detached_it_falls_and_can_be_attached_again(world):
    robot, box, made = pair(world)
    run(world, 100)
    world.detach(made)
    run(world, 50)
    fallen = between(robot, box)
    assert fallen.position[2] < -0.305
    world.attach((robot, "lift_link"), (box, "cube_link"))
    box.place(box.state()[0])
    run(world, 100)
    assert near(between(robot, box), fallen, 1e-3)


def test_what_is_attached_goes_along_when_something_other_than_time_moves_it(world):
    """Else it was drawn there by the engine, and both flew away at 100 m/s."""
    robot, box, _ = pair(world)
    simulator, before = Simulator(world), between(robot, box)
    other = world.spawn("other", parse_urdf(cube()), Pose((0.5, 0.0, 0.1)))
    world.attach((other, "cube_link"), (box, "cube_link"))
    simulator.set_joint_states(robot, {"lift": 0.3})
    assert near(between(robot, box), before)
    run(world, 200)
    assert near(between(robot, box), before)
    assert other.state()[0].position[2] == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("order", [1, -1])
def test_one_that_is_placed_takes_along_what_is_free_and_leaves_what_is_fixed(world, order):
    simulator = Simulator(world)
    boxes = [
        world.spawn(name, parse_urdf(cube()), Pose((x, 0.0, 1.0), from_rpy(x, 0.2, 0.3)))
        for name, x in (("a", 0.0), ("b", 0.2))
    ]
    made = world.attach(*((box, "cube_link") for box in boxes[::order]))
    before = boxes[1].state()[0].relative_to(boxes[0].state()[0])
    simulator.place_model(boxes[0], Pose((1.0, 2.0, 1.5), from_rpy(0.5, 0.0, 2.0)), AT_REST)
    run(world, 50)
    assert near(boxes[1].state()[0].relative_to(boxes[0].state()[0]), before)
    assert math.dist(boxes[1].state()[0].position, (1.0, 2.0, 1.5)) < 0.3
    world.detach(made)
    robot, box, _ = pair(world)
    simulator.place_model(box, Pose((1.0, 1.0, 1.0)), AT_REST)
    assert not world.attachments
    run(world, 10)
    assert near(box.state()[0], Pose((1.0, 1.0, 1.0)), 1e-3)
    assert near(robot.state()[0], Pose())


def test_it_ends_with_a_reset_and_with_either_model(world):
    robot, box, _ = pair(world, Pose((0.3, 0.0, 1.0)))
    for joints in (False, True):
        world.reset(joints)
        assert not world.attachments
        run(world, 100)
        assert box.state()[0].position[2] < 0.97
        world.attach((robot, "lift_link"), (box, "cube_link"))
    for name, text in (("cube", cube()), ("gripper", gripper())):
        world.delete(name)
        assert not world.attachments
        run(world, 10)
        world.spawn(name, parse_urdf(text), PLACE)
        models = world.models["gripper"], world.models["cube"]
        world.attach(*zip(models, ("lift_link", "cube_link"), strict=True))
    run(world, 10)


def test_it_stays_when_a_link_changes_and_when_the_engine_begins_anew(world):
    robot, box, _ = pair(world)
    before = between(robot, box)
    world.set_inertia(box, "cube_link", Inertia(0.2, ixx=1e-3, iyy=1e-3, izz=1e-3, ixy=1e-5))
    begin_anew(world, parse_urdf(cube()))
    run(world, 300)
    assert near(between(robot, box), before)


def test_a_static_model_holds_what_is_attached_to_it(world):
    text = cube().replace("</robot>", "<gazebo><static>true</static></gazebo></robot>")
    wall = world.spawn("wall", parse_urdf(text), Pose((0.0, 0.0, 1.0)))
    box = world.spawn("cube", parse_urdf(cube()), Pose((0.1, 0.0, 1.0)))
    world.attach((wall, "cube_link"), (box, "cube_link"))
    run(world, 1000)
    assert near(box.state()[0], Pose((0.1, 0.0, 1.0)))
