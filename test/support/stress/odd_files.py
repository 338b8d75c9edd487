"""A client that reads and spawns damaged files: python3 -m stress.odd_files SEED COUNT FOLDER.

Each is read by the function for its kind, and spawned over ROS where it is a model's; either works, or is
refused in one line. Its last line is a JSON object with the numbers of those read, spawned and refused.
"""

from __future__ import annotations

import json
import random
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from gazebo_msgs.srv import DeleteModel, GetWorldProperties, SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion
from support.mutations.mesh_worker import SDF
from support.mutations.meshes import mesh_files
from support.mutations.models import CASES
from support.stress.drawing import drawn

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.files.meshes import read_mesh
from ros_calls.service import ServiceClient, ServiceFailed

BOUND = 120.0  # [s] for an answer
AT_ONCE = 5  # files of one kind that are drawn at a time
MESH = "mesh"
KINDS = [*CASES, MESH, MESH, MESH]
SPAWNED = {"urdf": "spawn_urdf_model", "sdf": "spawn_sdf_model", "entity": "spawn_sdf_model"}


class OddFiles:
    """Reads and spawns.

    Args:
        folder: for files that others are to read.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.done: Counter[str] = Counter()

    def try_one(self, kind: str, drawn: Any) -> None:
        """Reads it, and spawns it if a simulator can."""
        if kind == MESH:
            path = self._folder / f"mesh_{sum(self.done.values())}{drawn[0]}"
            path.write_bytes(drawn[1])
            self.done[f"{kind} {self._read_mesh(path)}"] += 1
            for static in (0, 1):
                self._spawn(kind, "spawn_sdf_model", SDF.format(static=static, path=path))
            path.unlink()
            return
        outcome = CASES[kind].read(drawn)
        self.done[f"{kind} {'read' if outcome == 'read' else 'refused'}"] += 1
        if kind in SPAWNED:
            self._spawn(kind, SPAWNED[kind], drawn)

    def _read_mesh(self, path: Path) -> str:
        try:
            mesh = read_mesh(path)
        except DescriptionError as error:
            assert str(path) in str(error) and "\n" not in str(error), error
            return "refused"
        assert abs(mesh.vertices).max() <= 1e12
        assert mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices)
        return "read"

    def _spawn(self, kind: str, service: str, xml: str) -> None:
        """It is there and goes again, or the answer says why not; in the time of the world's answer."""
        pose = Pose(Point(0.0, 0.0, 1.0), Quaternion(0.0, 0.0, 0.0, 1.0))
        before = models()
        try:
            answer = ServiceClient(f"/gazebo/{service}", SpawnModel, timeout=BOUND)(
                "odd", xml, "", pose, "world"
            )
        except ServiceFailed as fault:
            assert "cannot process request: " in str(fault), f"{fault} over {xml[:2000]}"
            self.done[f"{kind} not spawned"] += 1
            assert models() == before, xml[:2000]
            return
        self.done[f"{kind} {'spawned' if answer.success else 'not spawned'}"] += 1
        assert answer.success or answer.status_message, xml[:2000]
        for name in set(models()) - set(before):
            assert answer.success, f"{name} is there: {xml[:2000]}"
            gone = ServiceClient("/gazebo/delete_model", DeleteModel, timeout=BOUND)(name)
            assert gone.success, gone.status_message


def models() -> list[str]:
    """The models that are in the world."""
    ask = ServiceClient("/gazebo/get_world_properties", GetWorldProperties, timeout=BOUND)
    return list(ask().model_names)


def main(number: int, count: int, folder: Path) -> None:
    """Tries so many files."""
    dice, odd = random.Random(number), OddFiles(folder)
    strategies = {kind: case.texts for kind, case in CASES.items()} | {MESH: mesh_files()}
    done = 0
    while done < count:
        kind = dice.choice(KINDS)
        for each in drawn(strategies[kind], min(AT_ONCE, count - done), dice.randrange(2**32)):
            odd.try_one(kind, each)
            done += 1
    print(json.dumps(odd.done), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
