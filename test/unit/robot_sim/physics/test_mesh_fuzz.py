"""Damaged mesh files: read sensibly or refused in one line, and the process lives."""

import pytest
from hypothesis import HealthCheck, given, settings
from support.mutations.meshes import mesh_files
from support.robots.snippets import collision, sdf, sdf_link
from support.robots.worlds import run

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.meshes import read_mesh
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose

QUICK = settings(deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
pytestmark = pytest.mark.slow


@settings(QUICK, max_examples=300)
@given(mesh_files())
def test_what_is_read_is_whole(tmp_path_factory, file):
    path = tmp_path_factory.getbasetemp() / f"mesh{file[0]}"
    path.write_bytes(file[1])
    try:
        mesh = read_mesh(path)
    except DescriptionError as error:
        assert str(path) in str(error)
        assert "\n" not in str(error)
        return
    assert mesh.vertices.shape[1:] == mesh.faces.shape[1:] == (3,)
    assert abs(mesh.vertices).max() <= 1e12
    assert mesh.faces.min() >= 0
    assert mesh.faces.max() < len(mesh.vertices)


@settings(QUICK, max_examples=60)
@given(file=mesh_files())
def test_no_mesh_ends_an_engine(world, tmp_path_factory, file):
    """One that moves and one that stands; an engine that crashes ends this process."""
    path = tmp_path_factory.getbasetemp() / f"mesh{file[0]}"
    path.write_bytes(file[1])
    shape = sdf_link("l", more=collision(f"<mesh><uri>{path}</uri></mesh>"))
    for static in (False, True):
        try:
            world.spawn("m", parse_sdf(sdf(shape, static=static)), Pose())
        except DescriptionError as error:
            assert str(path) in str(error) and "\n" not in str(error)
        else:
            run(world, 10)
            world.delete("m")
