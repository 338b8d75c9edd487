"""A process that spawns mesh files: an engine that crashes over one fails one test, not all.

As a program it reads names of files from its standard input, a line each, and answers each by a line of
JSON.
"""

import json
import os
import select
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
LONGEST = 300.0  # [s] for one file; a mesh of these tests takes milliseconds
STEPS = 10
SDF = """<sdf version="1.6"><model name="m"><static>{static}</static><link name="l"><collision name="c">
<geometry><mesh><uri>{path}</uri></mesh></geometry></collision></link></model></sdf>"""


class MeshWorker:
    """Spawns files in a world of its own process, which is started anew where it has died."""

    def __init__(self, engine: str, folder: Path) -> None:
        self._engine, self._folder = engine, folder
        self._process: subprocess.Popen[str] | None = None

    def spawn(self, suffix: str, data: bytes) -> list[str]:
        """Returns what became of the mesh where it moves and where it stands: "spawned", or the refusal.

        Raises:
            AssertionError: if the process has died, stands still, or met anything but a refusal.
        """
        path = self._folder / f"mesh{suffix}"
        path.write_bytes(data)
        process = self._running()
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(f"{path}\n")
        process.stdin.flush()
        if not select.select([process.stdout], [], [], LONGEST)[0]:
            self.close()
            raise AssertionError(f"no answer within {LONGEST:g} s to {suffix} {data[:300]!r}")
        line = process.stdout.readline()
        if not line:
            code = process.wait()
            self.close()
            raise AssertionError(f"the process ended with {code} over {suffix} {data[:300]!r}")
        answers: list[str] = json.loads(line)
        for answer in answers:
            refused = answer.startswith("refused: ") and str(path) in answer and "\n" not in answer
            assert refused or answer == "spawned", f"{answer} over {suffix} {data[:300]!r}"
        return answers

    def _running(self) -> "subprocess.Popen[str]":
        if self._process is None:
            paths = os.pathsep.join([str(ROOT / "src"), *filter(None, sys.path)])
            self._process = subprocess.Popen(
                [sys.executable, __file__, self._engine], env={**os.environ, "PYTHONPATH": paths},
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            )  # fmt: skip
        return self._process

    def close(self) -> None:
        """Ends the process, if there is one."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


def answers(engine: str, path: str) -> list[str]:
    """What becomes of a mesh that moves, and of one that stands."""
    from bullet_gazebo.physics.description import DescriptionError
    from bullet_gazebo.physics.engines import make_engine
    from bullet_gazebo.physics.files.sdf import parse_sdf
    from bullet_gazebo.physics.pose import Pose
    from bullet_gazebo.physics.world import World, ground_plane

    found = []
    for static in (0, 1):
        world = World(make_engine(engine))
        world.spawn("ground_plane", ground_plane(), Pose())
        try:
            world.spawn("m", parse_sdf(SDF.format(static=static, path=path)), Pose())
            for _ in range(STEPS):
                world.step()
            world.delete("m")
            found.append("spawned")
        except DescriptionError as error:
            found.append(f"refused: {error}")
        except Exception as error:  # noqa: BLE001  whatever it is, it is a finding
            found.append(f"{type(error).__name__}: {error}")
        world.close()
    return found


def main() -> None:
    out = os.fdopen(os.dup(1), "w")  # what the engine prints is no answer
    os.dup2(2, 1)
    for line in sys.stdin:
        out.write(json.dumps(answers(sys.argv[1], line.rstrip("\n"))) + "\n")
        out.flush()


if __name__ == "__main__":
    main()
