"""URDF as sdformat, the library of Gazebo, reads it: links, shapes and joints, with names and order."""

import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bullet_gazebo.physics.description import ModelDescription
from bullet_gazebo.physics.dynamics import poses_at_zero, tensor_in
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import IDENTITY, Pose, rotate

ROOT = Path(__file__).resolve().parents[4]
SOURCE = ROOT / "test/support/sdformat.cc"
ROBOTS = sorted((ROOT / "test/data/robots").glob("*.urdf"))
CLOSE = 1e-6


@pytest.fixture(scope="session")
def sdformat(tmp_path_factory):
    """A program that prints what sdformat reads of a file."""
    package = ["pkg-config", "--cflags", "--libs", "sdformat12"]
    missing = "sdformat is missing: apt-get install libsdformat-dev pkgconf"
    if shutil.which(package[0]) is None:
        pytest.skip(missing)
    found = subprocess.run(package, check=False, capture_output=True, text=True)
    if found.returncode:
        pytest.skip(missing)
    program = tmp_path_factory.mktemp("sdformat") / "read"
    flags = shlex.split(found.stdout)
    subprocess.run(["g++", str(SOURCE), "-o", str(program), *flags], check=True)
    return program


def theirs(program: Path, path: Path) -> list[list[str]]:
    """The words of each line that the program prints."""
    done = subprocess.run([program, path], check=True, capture_output=True, text=True)
    return [line.split() for line in done.stdout.splitlines()]


def ours(model: ModelDescription) -> Iterator[list]:
    """The same words and numbers from our reading."""
    poses = poses_at_zero(model)
    for name, link in model.links.items():
        if link.part_of:  # for the engine: it closes a loop
            continue
        inertia = link.inertia
        assert inertia is not None
        tensor = tensor_in(inertia, IDENTITY)
        numbers = [
            *place(model.root_pose.compose(poses[name])),
            inertia.mass,
            *inertia.com.position,
        ]
        yield ["link", name, *numbers, *tensor[np.triu_indices(3)]]
        for kind, shapes in (("collision", link.collisions), ("visual", link.visuals)):
            for shape in shapes:
                yield [kind, shape.name, *place(shape.pose)]
        for sensor in model.sensors:
            if sensor.link == name:
                yield ["sensor", sensor.name, *place(sensor.pose)]
    for joint in model.joints.values():
        yield ["joint", joint.name, joint.parent, model.links[joint.child].owner, *place(joint.anchor),
               *(rotate(joint.anchor.orientation, joint.axis) if joint.movable else ()),
               *((joint.spring_stiffness, joint.spring_reference) if joint.movable else ()),
               *((joint.lower, joint.upper) if joint.bounded else ())]  # fmt: skip


def place(pose: Pose) -> tuple:
    return (*pose.position, *pose.orientation)


def assert_same(model: ModelDescription, lines: list[list[str]]) -> None:
    """Compares names, order and numbers; quaternions up to their sign."""
    own = list(ours(model))
    assert [names(line) for line in own] == [names(line) for line in lines]
    for mine, other in zip(own, lines, strict=True):
        count = len(names(mine))
        numbers = np.array(mine[count:], float)
        wanted = np.array(other[count : count + len(numbers)], float)
        turns = slice(3, 7)
        if wanted[turns] @ numbers[turns] < 0.0:
            wanted[turns] = -wanted[turns]
        x, y, z, w = numbers[turns]
        if abs(2.0 * (w * y - z * x)) > 0.999:
            # Its turns pass through roll, pitch and yaw, which lose digits near a pitch of 90 degrees.
            assert numbers[turns] == pytest.approx(wanted[turns], abs=2e-3), mine
            numbers[turns] = wanted[turns]
        assert numbers == pytest.approx(wanted, abs=CLOSE, rel=CLOSE), mine


def names(line: list) -> list:
    return line[: 4 if line[0] == "joint" else 2]


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_our_robots(sdformat, path):
    text = path.read_text()
    if "xacro" in text or 'link="world"' in text or 'name="world"' in text:
        pytest.skip("no plain file, or joined to the world, which is no link for sdformat")
    assert_same(parse_urdf(text), theirs(sdformat, path))


def test_joints_that_close_loops(sdformat, tmp_path):
    """They come after those of the URDF."""
    text = (ROOT / "test/data/robots/four_bar_gripper.urdf").read_text()
    text = re.sub('<link name="world"/>|<joint name="mount".*?</joint>', "", text, flags=re.DOTALL)
    path = tmp_path / "floating.urdf"
    path.write_text(text)
    assert_same(parse_urdf(text), theirs(sdformat, path))


NAMES = ["base", "base_link", "arm", "arm_tip", "tip", "left", "wheel", "a", "ab", "hull"]
NUMBERS = st.floats(-2.0, 2.0).map(lambda value: round(value, 3))
THREE = st.tuples(NUMBERS, NUMBERS, NUMBERS)


def words(numbers: tuple) -> str:
    return " ".join(map(str, numbers))


@st.composite
def robots(draw) -> str:
    """URDF of a tree of links, some of them joined by fixed joints, with shapes of and without names."""
    links = draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=7, unique=True))
    joints = draw(st.permutations([f"{letter}_joint" for letter in "bacfed"]))
    parts = []
    for number, link in enumerate(links):
        shapes = []
        for tag in ("collision", "visual"):
            for own in draw(st.lists(st.sampled_from(["", *NAMES]), max_size=2)):
                name = f' name="{own}"' if own else ""
                shapes.append(
                    f'<{tag}{name}><origin xyz="{words(draw(THREE))}" rpy="{words(draw(THREE))}"/>'
                    f'<geometry><box size="0.1 0.2 0.3"/></geometry></{tag}>'
                )
        x, y, z = draw(st.tuples(*[st.floats(0.1, 1.0)] * 3))  # of a body's mass about its axes
        parts.append(
            f'<link name="{link}"><inertial><origin xyz="{words(draw(THREE))}" rpy="{words(draw(THREE))}"/>'
            f'<mass value="{draw(st.floats(0.1, 9.0))}"/><inertia ixx="{y + z}" iyy="{x + z}" izz="{x + y}"'
            f' ixy="0" ixz="0" iyz="0"/></inertial>{"".join(shapes)}</link>'
        )
        if number:
            parent = links[draw(st.integers(0, number - 1))]
            kind = draw(st.sampled_from(["fixed", "fixed", "revolute", "continuous", "prismatic"]))
            axis = draw(st.sampled_from(["1 0 0", "0 1 0", "0 0 1", "0.6 0 -0.8"]))
            parts.append(
                f'<joint name="{joints[number - 1]}" type="{kind}"><parent link="{parent}"/>'
                f'<child link="{link}"/><origin xyz="{words(draw(THREE))}" rpy="{words(draw(THREE))}"/>'
                f'<axis xyz="{axis}"/><limit lower="-0.5" upper="0.7" effort="3" velocity="2"/></joint>'
            )
            for tag in draw(st.lists(st.sampled_from(["springStiffness", "springReference"]))):
                spring = draw(st.sampled_from(["<{0}> {1} </{0}>", '<{0} value="{1}"/>']))
                parts.append(
                    f'<gazebo reference="{joints[number - 1]}">{spring.format(tag, draw(NUMBERS))}</gazebo>'
                )
    order = draw(st.permutations(parts))
    return f'<robot name="drawn">{"".join(order)}</robot>'


@settings(max_examples=60)
@given(text=robots())
def test_trees_of_links(sdformat, tmp_path_factory, text):
    path = tmp_path_factory.getbasetemp() / "drawn.urdf"
    path.write_text(text)
    assert_same(parse_urdf(text), theirs(sdformat, path))
