"""new_robot.py: what a robot's file draws on comes along, or is found again."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from support.mutations.mesh_files import binary_stl
from support.robots.new_robots import BARE, FIXED, LINK, SWING, robot

from package_writing.urdf_files import copy_urdf

ROBOTS = Path(__file__).resolve().parents[2] / "data/robots"


def test_xacro_files_that_it_includes_and_arguments(new, tmp_path):
    (tmp_path / "arm/urdf").mkdir(parents=True)
    (tmp_path / "arm/common").mkdir()
    (tmp_path / "arm/urdf/arm.urdf.xacro").write_text(
        robot(
            '<xacro:arg name="rod" default="none"/><xacro:include filename="parts/links.xacro"/>',
            '<xacro:property name="n" value="joints"/><xacro:include filename="../common/${n}.xacro"/>',
        )
    )
    (tmp_path / "arm/urdf/parts").mkdir()
    links = LINK.format("base", "") + LINK.format("$(arg rod)", "")
    (tmp_path / "arm/urdf/parts/links.xacro").write_text(robot(links))
    (tmp_path / "arm/common/joints.xacro").write_text(robot(SWING, FIXED))
    folder, made, _, told = new("my_parts", tmp_path / "arm/urdf/arm.urdf.xacro", "rod:=rod")
    (tmp_path / "arm").rename(tmp_path / "gone")
    made.check()
    assert sorted(str(each.relative_to(folder)) for each in folder.glob("urdf/**/*.xacro")) == [
        *("urdf/common/joints.xacro", "urdf/my_parts_control.urdf.xacro"),
        *("urdf/urdf/arm.urdf.xacro", "urdf/urdf/parts/links.xacro"),
    ]
    assert "rod:=rod" in (folder / "launch/simulation.launch").read_text()
    assert "not copied" not in told


def test_what_lies_elsewhere_is_told(new, tmp_path):
    (tmp_path / "far").mkdir()
    other = tmp_path / "far/links.xacro"
    other.write_text(robot(LINK.format("base", "") + LINK.format("rod", "")))
    (tmp_path / "near/urdf").mkdir(parents=True)
    urdf = tmp_path / "near/urdf/arm.xacro"
    urdf.write_text(robot(f'<xacro:include filename="{other}"/>', SWING, FIXED))
    *_, told = new("my_far", urdf)
    assert f"not copied, and read from where it is: {other}" in told


def test_meshes_by_a_plain_path_come_along(new, tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/rod.stl").write_bytes(binary_stl())
    shape = '<geometry><mesh filename="meshes/rod.stl" scale="1 1 1"/></geometry>'
    rod = LINK.format("rod", f"<visual>{shape}</visual><collision>{shape}</collision>")
    folder, made, *_ = new("my_meshes", robot(BARE[0], rod, SWING, FIXED))
    assert (folder / "meshes/rod.stl").is_file()
    assert made.links.links["rod"].collisions[0].mesh == str(folder / "meshes/rod.stl")


KINDS = ("visual", "collision")


def rod(package: Path, start: str = "package://") -> str:
    """A link with meshes of one name, which it writes to folders of a package."""
    shapes = ""
    for kind in KINDS:
        folder = package / "meshes" / kind
        folder.mkdir(parents=True)
        (folder / "rod.stl").write_bytes(binary_stl(len(kind)))
        mesh = f'<mesh filename="{start}{package.name}/meshes/{kind}/rod.stl"/>'
        shapes += f"<{kind}><geometry>{mesh}</geometry></{kind}>"
    return LINK.format("rod", shapes)


def test_meshes_of_a_package_that_was_downloaded_without_its_package_xml_come_along(new, tmp_path):
    urdf = tmp_path / "arm_files/urdf/arm.urdf"
    urdf.parent.mkdir(parents=True)
    urdf.write_text(robot(BARE[0], rod(tmp_path / "arm_files"), SWING, FIXED))
    folder, made, *_ = new("my_download", urdf)
    for kind in KINDS:
        copy = folder / "meshes/arm_files" / kind / "rod.stl"
        assert copy.read_bytes() == binary_stl(len(kind))
    assert made.links.links["rod"].collisions[0].mesh == str(copy)


@pytest.fixture
def described(tmp_path, monkeypatch):
    """A xacro file of a package for ROS 2 that draws on itself, and another package in a false condition."""
    other = tmp_path / "ws/their_description"
    (other / "urdf").mkdir(parents=True)
    (other / "package.xml").write_text(
        "<package><name>their_description</name><export><build_type>ament_cmake</build_type></export></package>"
    )
    (other / "urdf/links.xacro").write_text(robot(BARE[0], rod(other, "$(arg from)")))
    urdf = other / "urdf/arm.urdf.xacro"
    urdf.write_text(
        robot(
            '<xacro:arg name="from" default="package://"/>',
            '<xacro:include filename="$(find their_description)/urdf/links.xacro"/>', SWING, FIXED,
            '<xacro:if value="false"><xacro:include filename="$(find nobodys)/hand.xacro"/></xacro:if>',
        )
    )  # fmt: skip
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}/ws:{os.environ['ROS_PACKAGE_PATH']}")
    monkeypatch.setenv("CARTPOLE_WITH", str(tmp_path / "ws"))
    return urdf


@pytest.mark.slow
def test_a_package_that_it_needs_is_depended_on(new, tmp_path, described):
    folder, made, _, told = new("my_described", described)
    made.check()
    depends = re.findall("<exec_depend>(.*)</exec_depend>", (folder / "package.xml").read_text())
    assert "their_description" in depends and "nobodys" not in depends
    assert "takes files from other packages (--standalone copies them): their_description" in told
    assert f"./ws --with {tmp_path}/ws --with " in told


@pytest.mark.slow
@pytest.mark.parametrize("start", ["package://", "file://{}/ws/"])
def test_a_standalone_package_needs_no_other(new, tmp_path, described, start):
    argument = f"from:={start.format(tmp_path)}"
    folder, made, _, told = new("my_own", described, "--standalone", argument)
    (tmp_path / "ws").rename(tmp_path / "gone")
    made.check()
    for kind, shapes in (("visual", "visuals"), ("collision", "collisions")):
        (copy,) = folder.glob(f"meshes/**/{kind}/rod.stl")
        assert copy.read_bytes() == binary_stl(len(kind))
        assert getattr(made.links.links["rod"], shapes)[0].mesh == str(copy)
    assert "their_description" not in (folder / "package.xml").read_text()
    assert f"./ws --with {folder} test" in told and argument not in told


def test_meshes_of_one_name_stay_apart(tmp_path):
    shapes = ""
    for size, owner in enumerate(("arm", "gripper"), start=1):
        meshes = tmp_path / owner / "meshes"
        meshes.mkdir(parents=True)
        (meshes / "base.stl").write_bytes(binary_stl(size))
        (meshes / "cup.obj").write_text(f"mtllib paint.mtl\n# {owner}\n")
        (meshes / "paint.mtl").write_text(owner)
        for name in ("base.stl", "cup.obj"):
            shapes += f'<visual><geometry><mesh filename="{meshes}/{name}"/></geometry></visual>'
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(robot(LINK.format("base", shapes)))
    copied = copy_urdf(urdf, {}, "mine", tmp_path / "mine", standalone=True)
    places = re.findall('filename="package://mine/(.*?)"', copied.xml)
    assert places == [f"meshes/{name}" for name in ("base.stl", "cup.obj", "2/base.stl", "2/cup.obj")]
    for size, place, owner in ((1, "meshes", "arm"), (2, "meshes/2", "gripper")):
        folder = tmp_path / "mine" / place
        assert (folder / "base.stl").read_bytes() == binary_stl(size)
        assert (folder / "paint.mtl").read_text() == owner
