"""Damaged mesh files: read sensibly or refused in one line, and the process lives."""

import pytest
from hypothesis import HealthCheck, given, settings
from support.mutations.mesh_worker import MeshWorker
from support.mutations.meshes import mesh_files

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.files.meshes import read_mesh

QUICK = settings(deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
ENGINES = ["ode", pytest.param("mujoco", marks=pytest.mark.extras("mujoco"))]


@pytest.fixture(scope="module", params=ENGINES)
def worker(request, tmp_path_factory):
    worker = MeshWorker(request.param, tmp_path_factory.mktemp("meshes"))
    yield worker
    worker.close()


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
@given(mesh_files())
def test_no_mesh_ends_an_engine(worker, file):
    worker.spawn(*file)
