"""Files as sdformat, the library of Gazebo, reads them: links, shapes, sensors and joints, names and order.

It is sdformat 12, Gazebo 11 has 9. What is compared here is the same in both, except where a comment says so.
"""

import math
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from support.robots.drawn_files import sdf_models, urdf_robots, worlds

from file_access.expansion import expand
from robot_sim.physics.description import Joint, Light, ModelDescription, Shape
from robot_sim.physics.dynamics import link_poses, tensor_in
from robot_sim.physics.files.own_models import own_models
from robot_sim.physics.files.reading import Reading, Resources
from robot_sim.physics.files.world_file import WorldDescription, load_world, read_entity
from robot_sim.physics.lumping import WORLD
from robot_sim.physics.pose import IDENTITY, Pose, rotate

ROOT = Path(__file__).resolve().parents[4]
SOURCE = ROOT / "test/support/sdformat.cc"
FOLDERS = ("urdf", "worlds", "companions", "src/package_writing", "test/data")
# One is included by others; the rest lack what sdformat needs to read anything of them.
LEFT_OUT = ("parts.xacro", "mutations", "boxes.world")
FILES = sorted(
    path
    for folder in FOLDERS
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".urdf", ".xacro", ".sdf", ".world") and not set(path.parts) & set(LEFT_OUT)
)
OWN = tuple(sorted(own_models()))
CLOSE = 1e-6
NO_LIMIT = 1e15
WORDS = {  # how many a line begins with
    "world": 2, "light": 3, "model": 2, "link": 2, "collision": 3, "visual": 3, "sensor": 4, "joint": 5,
}  # fmt: skip
POSE = 7  # numbers


class Sdformat:
    """A process that reads files by sdformat, and a folder of models that both sides find as model://."""

    def __init__(self, program: Path, folder: Path) -> None:
        self.resources = Resources(models=(folder,), package=lambda name: str(ROOT / name))
        self.folder = folder
        pipe, null = subprocess.PIPE, subprocess.DEVNULL
        command = [program, folder]
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=null, text=True)

    def read(self, path: Path) -> list[list[str]]:
        """The words of each line of a file."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(f"{path}\n")
        self._process.stdin.flush()
        lines = iter(self._process.stdout.readline, "\n")
        return [line.rstrip("\n").split("\t") for line in lines if line]

    def close(self) -> None:
        self._process.communicate(timeout=10.0)


@pytest.fixture(scope="session")
def sdformat(tmp_path_factory):
    package = ["pkg-config", "--cflags", "--libs", "sdformat12"]
    found = shutil.which(package[0]) and subprocess.run(package, check=False, capture_output=True, text=True)
    if not found or found.returncode:
        pytest.skip("sdformat is missing: apt-get install libsdformat-dev pkgconf")
    program = tmp_path_factory.mktemp("sdformat") / "read"
    subprocess.run(["g++", str(SOURCE), "-o", str(program), *shlex.split(found.stdout)], check=True)
    folder = tmp_path_factory.mktemp("models")
    config = '<model><name>{}</name><sdf version="1.6">model.sdf</sdf></model>'
    for name, element in own_models().items():
        (folder / name).mkdir()
        text = ElementTree.tostring(element, encoding="unicode")
        (folder / name / "model.sdf").write_text(f'<sdf version="1.6">{text}</sdf>')
        (folder / name / "model.config").write_text(config.format(name))
    (folder / "crate").symlink_to(ROOT / "test/data/models/crate")
    process = Sdformat(program, folder)
    yield process
    process.close()


Row = list[Any]
"""A line: words, numbers and poses."""


def rows_of_world(world: WorldDescription) -> Iterator[Row]:
    yield ["world", world.name, *world.gravity, world.time_step, world.update_rate]
    for light in world.lights.values():
        yield row_of_light(light)
    for model in world.models.values():
        yield from rows_of_model(model)


def row_of_light(light: Light) -> Row:
    factors = (light.attenuation_constant, light.attenuation_linear, light.attenuation_quadratic)
    return [
        "light", light.name, light.kind, light.pose, *light.diffuse, *light.specular, *factors,
        *light.direction, float(light.cast_shadows),
    ]  # fmt: skip


def rows_of_model(model: ModelDescription) -> Iterator[Row]:
    yield ["model", model.name, model.initial_pose, float(model.static)]
    poses = link_poses(model, model.root_pose, {})
    for name, link in model.links.items():
        if name == WORLD or link.part_of:  # no links for sdformat; the latter closes a loop
            continue
        inertia = link.inertia
        assert inertia is not None
        tensor = tensor_in(inertia, IDENTITY)[np.triu_indices(3)]
        numbers = (inertia.mass, *inertia.com.position, *tensor, float(link.gravity))
        yield ["link", name, poses[name], *numbers]
        yield from (row_of_shape("collision", shape) for shape in link.collisions)
        yield from (row_of_shape("visual", shape) for shape in link.visuals)
        for each in model.sensors:
            if each.link == name and not each.joint:
                yield ["sensor", each.name, each.kind, name, each.pose, each.rate]
    # A single fixed joint to the world is no joint here, but says that the base is fixed.
    for name in model.world_joints:
        if name not in (WORLD, *model.joints):
            yield ["joint", name, "fixed", WORLD, model.root, Pose()]
    for joint in model.joints.values():
        yield row_of_joint(joint, model.links[joint.child].owner)


def row_of_shape(kind: str, shape: Shape) -> Row:
    return [kind, shape.name, shape.kind, shape.pose, *shape.size]


def row_of_joint(joint: Joint, child: str) -> Row:
    row = ["joint", joint.name, joint.kind, joint.parent, child, joint.anchor]
    if not joint.movable:
        return row
    stops = (joint.lower, joint.upper) if joint.bounded else (-np.inf, np.inf)
    limits = [np.inf if number < 0.0 else number for number in (joint.effort, joint.velocity)]
    axis = rotate(joint.anchor.orientation, joint.axis)
    spring = (joint.spring_stiffness, joint.spring_reference)
    return [*row, *axis, joint.damping, joint.friction, *spring, *limits, *stops]


def plain(row: Row) -> list[str | float]:
    """A row of ours with a pose as seven numbers."""
    found: list[str | float] = []
    for each in row:
        found += [*each.position, *each.orientation] if isinstance(each, Pose) else [each]
    return found


def is_unseen(row: Row) -> bool:
    """Whether we leave a line of sdformat's out: planes that are only seen, and meshes that aren't there."""
    return row[0] == "visual" and row[2] in ("plane", "mesh")


def alike(row: Row) -> tuple[list[str], np.ndarray]:
    """The words and numbers of a line, the same for what means the same."""
    count = WORDS[row[0]]
    names, numbers = list(map(str, row[:count])), np.array(row[count:], float)
    if names[0] == "joint" and names[2] == "fixed":
        numbers = numbers[:0]  # its frame and axis tell nothing
    elif names[0] == "joint":
        limits = numbers[-4:]
        limits[:2] = np.where(limits[:2] < 0.0, np.inf, limits[:2])
        limits[abs(limits) >= NO_LIMIT] = np.copysign(np.inf, limits[abs(limits) >= NO_LIMIT])
        if names[2] == "revolute" and np.isinf(limits[2:]).all():
            names[2] = "continuous"
    elif names[0] == "collision" and names[2] == "plane":
        numbers = numbers[:0]  # ours is turned onto its normal
    return names, numbers


def assert_same(rows: Iterable[Row], lines: list[list[str]], steep: bool = False) -> None:
    """Compares names, order and numbers; quaternions up to their sign.

    `steep`: something in a URDF has a pitch near 90 degrees, where roll, pitch and yaw, through which lumping
    goes, lose digits of moments of inertia.
    """
    own = [alike(plain(row)) for row in rows if not is_unseen(row)]
    complaints = [line[1] for line in lines if line[0] == "error"]
    other = [alike(line) for line in lines if line[0] != "error" and not is_unseen(line)]
    assert [names for names, _ in own] == [names for names, _ in other], complaints
    if any("non-unique name" in text for text in complaints):
        return  # sdformat 12 knows no pose where a joint is named as a link is; 9 only warns
    for (names, numbers), (_, wanted) in zip(own, other, strict=True):
        assert len(numbers) == len(wanted), names
        turns = slice(3, POSE)
        if len(numbers) >= POSE and names[0] != "world":
            if wanted[turns] @ numbers[turns] < 0.0:
                wanted[turns] = -wanted[turns]
            x, y, z, w = numbers[turns]
            if abs(2.0 * (w * y - z * x)) > 0.999:
                # Its turns pass through roll, pitch and yaw, which lose digits near a pitch of 90 degrees.
                assert numbers[turns] == pytest.approx(wanted[turns], abs=1e-2), names
                numbers[turns] = wanted[turns]
        if steep and names[0] == "link":
            tensor = slice(POSE + 4, POSE + 10)
            assert numbers[tensor] == pytest.approx(wanted[tensor], abs=1e-2 * wanted[POSE]), names
            numbers[tensor] = wanted[tensor]
        # Lumping prints a sensor's pose with six digits.
        close = 1e-5 if names[0] == "sensor" else CLOSE
        assert numbers == pytest.approx(wanted, abs=close, rel=close), names


def check(sdformat: Sdformat, path: Path) -> None:
    """Compares the model or world of a file."""
    if "<world" in path.read_text():
        assert_same(rows_of_world(load_world(path, sdformat.resources)), sdformat.read(path))
        return
    lines = sdformat.read(path)
    name = next(line[1] for line in lines if line[0] in ("model", "light"))
    entity = read_entity(path.read_text(), name, sdformat.resources, Reading())
    rows = [row_of_light(entity)] if isinstance(entity, Light) else rows_of_model(entity)
    pitches = [float(each.split()[1]) for each in re.findall(r'rpy="([^"]+)"', path.read_text())]
    assert_same(rows, lines, any(abs(math.sin(pitch)) > 0.9999 for pitch in pitches))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_our_files(sdformat, tmp_path, path):
    if "<xacro:" in path.read_text():
        expanded = tmp_path / "expanded.urdf"
        expanded.write_text(expand(path))
        path = expanded
    check(sdformat, path)


@pytest.mark.parametrize("name", OWN)
def test_built_in_models(sdformat, name):
    check(sdformat, sdformat.folder / name / "model.sdf")


DRAWN = {"urdf": (urdf_robots(), 40), "sdf": (sdf_models(), 40), "world": (worlds((*OWN, "crate")), 10)}


@pytest.mark.parametrize("kind", DRAWN)
def test_drawn_files(sdformat, tmp_path, kind):
    texts, count = DRAWN[kind]
    path = tmp_path / f"drawn.{kind}"

    @settings(max_examples=count)
    @given(texts)
    def look(text):
        path.write_text(text)
        check(sdformat, path)

    look()
