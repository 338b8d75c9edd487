"""Static meshes in PyBullet: models that have the same one share its triangles, which take long to load."""

from pathlib import Path

from file_access.locks import scratch_folder
from robot_sim.physics.description import ModelDescription, Shape
from robot_sim.physics.engines.bullet_files import UNSEEN, write_mesh
from robot_sim.physics.engines.quiet_pybullet import pybullet
from robot_sim.physics.pose import Pose

Key = tuple[str, tuple[float, ...]]
"""A mesh's digest and scale."""


def static_mesh(model: ModelDescription) -> Shape | None:
    """Returns the mesh that a static model is, if it is nothing else and has the frame of its link.

    Other frames, also that of the centre of mass, would change the last bits of contacts.
    """
    link = model.links[model.root]
    frames = [*(shape.pose for shape in link.collisions), link.inertia and link.inertia.com]
    if not model.static or len(model.links) > 1 or frames not in ([Pose(), Pose()], [Pose(), None]):
        return None
    return link.collisions[0] if link.collisions[0].solid else None


class SharedMeshes:
    """The static meshes of a PyBullet world."""

    def __init__(self, client: int) -> None:
        self._client = client
        self._meshes: dict[Key, tuple[int, int]] = {}  # PyBullet's number, and the file's [bytes]
        self._users: dict[int, Key] = {}  # by body
        self._drawn = pybullet.createVisualShape(pybullet.GEOM_SPHERE, radius=UNSEEN, physicsClientId=client)

    @property
    def size(self) -> int:
        """Sum of the sizes of their files [bytes]."""
        return sum(size for _, size in self._meshes.values())

    def load(self, shape: Shape, pose: Pose) -> int:
        """Adds a body at `pose`; returns its number."""
        assert shape.solid is not None
        key = shape.solid.digest, shape.size
        if key not in self._meshes:
            with scratch_folder() as folder:
                path = write_mesh(shape.solid, folder, concave=True, objects=False)
                number = pybullet.createCollisionShape(
                    pybullet.GEOM_MESH, fileName=path, meshScale=shape.size,
                    flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH, physicsClientId=self._client,
                )  # fmt: skip
                self._meshes[key] = number, Path(path).stat().st_size
        body: int = pybullet.createMultiBody(
            0.0, self._meshes[key][0], self._drawn, pose.position, pose.orientation,
            physicsClientId=self._client,
        )  # fmt: skip
        pybullet.changeDynamics(body, -1, collisionMargin=0.0, physicsClientId=self._client)
        self._users[body] = key
        return body

    def remove(self, body: int) -> int:
        """Forgets a removed body; returns the size of a mesh that only it had, and PyBullet keeps."""
        key = self._users.pop(body, None)
        return 0 if key is None or key in self._users.values() else self._meshes.pop(key)[1]
