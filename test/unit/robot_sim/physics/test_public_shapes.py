"""Robots of the shapes that public ones have."""

import numpy as np
import pytest
from support.robots.public_shapes import DROP, MASS, RADIUS, STIFFNESS, mesh_arm, suspension

from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, rotate
from robot_sim.physics.world import GRAVITY


def corners(model) -> np.ndarray:
    """All corners of its collisions, with its joints turned."""
    poses = link_poses(model, model.root_pose, {"joint_1": 0.3, "joint_2": -0.4})
    found = [
        np.add(rotate(pose.orientation, tuple(vertex)), pose.position)
        for name, link in model.links.items()
        for shape in link.collisions
        for pose in [poses[name].compose(shape.pose)]
        for vertex in shape.solid.vertices
    ]
    return np.array(found)


def test_an_arm_of_collada_with_y_up_is_the_one_of_stl(tmp_path):
    """Gazebo and RViz read COLLADA's unit, and not its axis."""
    stl, dae = (parse_urdf(mesh_arm(tmp_path, kind)) for kind in ("stl", "dae"))
    ours, wanted = (np.unique(corners(arm).round(5), axis=0) for arm in (dae, stl))
    assert ours == pytest.approx(wanted, abs=2e-5)


def test_a_vehicle_on_springs_sinks_by_its_weight(make_world):
    world = make_world(ground=True)
    model = world.spawn("car", parse_urdf(suspension()), Pose((0.0, 0.0, DROP + RADIUS)))
    for _ in range(3000):
        world.step()
    sinks = MASS * -GRAVITY[2] / (4.0 * STIFFNESS)
    hull, struts = (
        model.state()[0].position,
        [model.joint_state(each)[0] for each in model.joint_names],
    )
    assert hull[2] == pytest.approx(DROP + RADIUS - sinks, abs=0.002)
    slides = [at for name, at in zip(model.joint_names, struts, strict=True) if "slide" in name]
    assert slides == pytest.approx([sinks] * 4, abs=0.002)
