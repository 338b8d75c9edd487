"""new_robot.py: what it writes for robots of all kinds, and what it refuses in one line."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from mesh_files import binary_stl

from bullet_gazebo.physics.files.urdf import parse_urdf
from package_writing import package
from package_writing.cli import main
from package_writing.ground import standing_height
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.options.training_options import choose
from robot_envs import RobotEnv

ROBOTS = Path(__file__).resolve().parents[2] / "data/robots"
JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>
<axis xyz="0 1 0"/>{4}</joint>"""
LINK = """<link name="{0}"><inertial><origin xyz="0 0 0.1"/><mass value="0.5"/>
<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>{1}</link>"""
LIMIT = '<limit lower="-1" upper="2" effort="20" velocity="3"/>'
MOTOR = """<transmission name="t_{0}"><type>transmission_interface/SimpleTransmission</type>
<joint name="{0}"><hardwareInterface>hardware_interface/{1}JointInterface</hardwareInterface></joint>
<actuator name="a"/></transmission>"""
PLUGIN = '<gazebo><plugin name="c" filename="libgazebo_ros_control.so">{}</plugin></gazebo>'
SWING = JOINT.format("swing", "revolute", "base", "rod", LIMIT)
FIXED = '<link name="world"/>' + JOINT.format("stand", "fixed", "world", "base", "")


def robot(*parts: str, name: str = "theirs") -> str:
    return (
        f'<robot name="{name}" xmlns:xacro="http://www.ros.org/wiki/xacro">{"".join(parts)}</robot>'
    )


NOBODYS = '<collision><geometry><mesh filename="package://nobodys/rod.stl"/></geometry></collision>'
BARE = (LINK.format("base", ""), LINK.format("rod", ""), SWING)


@pytest.fixture
def new(tmp_path, monkeypatch, capsys):
    """Writes packages, finds them, and gives the robot and the task; their modules are gone afterwards."""
    target = tmp_path / "packages"
    target.mkdir()
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{target}:{os.environ.get('ROS_PACKAGE_PATH', '')}")

    def write(name, text=None, *arguments):
        if isinstance(text, str):
            (tmp_path / "robot.urdf").write_text(text)
            text = tmp_path / "robot.urdf"
        urdf = [] if text is None else ["--urdf", str(text)]
        code = main([name, *urdf, "--to", str(target), *arguments])
        told = capsys.readouterr()
        assert code == 0, told.err
        monkeypatch.syspath_prepend(target / name / "src")
        made = importlib.import_module(f"{name}.robot").ROBOT
        return target / name, made, importlib.import_module(f"{name}.tasks").Reach, told.out

    before = set(sys.modules)
    yield write
    for name in set(sys.modules) - before:
        if name.partition(".")[0].startswith("my_"):
            del sys.modules[name]


def reaches(made, task) -> bool:
    """Whether who always goes towards the target gets there."""
    env = RobotEnv(made, task())
    try:
        observation, _ = env.reset(seed=1)
        joints, done, info = env.action_space.shape[0], False, {}
        while not done:
            way = observation[2 * joints : 3 * joints] - observation[3 * joints :]
            observation, _, _, done, info = env.step(np.clip(10.0 * way, -1.0, 1.0))
        return info["is_success"]
    finally:
        env.close()


def test_the_arm_that_comes_along(new):
    folder, made, task, told = new("my_arm")
    assert made.joints == ("elbow", "shoulder")
    assert reaches(made, task)
    assert f"written: {folder}" in told
    assert {path.name for path in folder.iterdir()} == {
        *("package.xml", "CMakeLists.txt", "setup.py", "README.md"),
        *("config", "launch", "src", "test", "urdf"),
    }
    assert not [path for path in folder.rglob("*") if path.is_file() and "%{" in path.read_text()]
    assert oct(folder.stat().st_mode & 0o777) == oct(0o777 & ~_umask())


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


@pytest.mark.parametrize("name", ["arm", "light_hand", "pendulum", "slides", "two_link_arm"])
def test_robots_of_many_kinds_reach_with_the_gains_that_they_get(new, name):
    """Six joints of 17 kg, fingers of grams, slides with all three interfaces."""
    _, made, task, _ = new(f"my_{name}", ROBOTS / f"{name}.urdf")
    assert reaches(made, task)


def test_what_is_written_is_tidy(new):
    folder, *_ = new("my_tidy", ROBOTS / "slides.urdf")
    ruff = [sys.executable, "-m", "ruff"]
    options = ["--isolated", "--no-cache", "--line-length", "100"]
    for command in (["check", "--extend-select", "I,W,B,SIM,UP"], ["format", "--diff"]):
        done = subprocess.run(
            [*ruff, *command, *options], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("interface", ["effort", "position", "velocity"])
def test_transmissions_plugin_and_base_that_lack_are_added_beside(new, interface):
    folder, made, task, told = new(
        f"my_{interface}", robot(*BARE), "--base", "fixed", "--interface", interface
    )
    added = f"urdf/my_{interface}_control.urdf.xacro"
    assert added in told and (folder / added).is_file()
    assert (folder / "urdf/robot.urdf").read_text() == robot(*BARE)
    assert made.links.fixed_base and made.links.plugins
    assert [each.interface for each in made.control.transmissions] == [
        f"{interface.capitalize()}JointInterface"
    ]
    assert reaches(made, task)


def test_a_base_without_mass_can_be_fixed(new):
    """As of most arms, which Gazebo would drop."""
    _, made, task, _ = new("my_light", robot('<link name="base"/>', *BARE[1:]), "--base", "fixed")
    assert made.links.fixed_base
    assert reaches(made, task)


def test_a_robot_whose_base_is_free(new):
    folder, made, _, told = new("my_rover", robot(*BARE), "--base", "free", "--height", "0.5")
    assert not made.links.fixed_base
    assert made.pose.position == (0.0, 0.0, 0.5)
    assert "-z 0.5" in (folder / "launch/simulation.launch").read_text()


ROUND = """<collision><origin rpy="1.5707963267948966 0 0"/><geometry>
<cylinder radius="0.1" length="0.04"/></geometry></collision>"""
CENTRED = LINK.replace("0 0 0.1", "0 0 0")
BOX = '<collision><geometry><box size="0.3 0.2 0.06"/></geometry></collision>'
SKIDS = "".join(
    f'<collision><origin xyz="{x} 0 -0.1"/><geometry><sphere radius="0.05"/></geometry></collision>'
    for x in (-0.12, 0.12)
)
SMOOTH = '<gazebo reference="base"><mu1>0</mu1><mu2>0</mu2></gazebo>'
HUB = '<origin xyz="0 {} -0.05"/><limit effort="5" velocity="20"/>'
ROVER = (
    CENTRED.format("base", BOX + SKIDS), SMOOTH, *(CENTRED.format(side, ROUND) for side in ("left", "right")),
    *(JOINT.format(f"{side}_wheel", "continuous", "base", side, HUB.format(y))
      for side, y in (("left", 0.15), ("right", -0.15))),
    CENTRED.format("mast", ""), JOINT.format("pan", "revolute", "base", "mast", LIMIT),
    CENTRED.format("caster", ""), JOINT.format("swivel", "continuous", "base", "caster", ""),
)  # fmt: skip


def controllers_of(folder):
    text = (folder / "config/controllers.yaml").read_text(encoding="utf-8")
    found = yaml.safe_load(text)
    return {each["joint"]: each["type"] for each in found.values() if "joint" in each}


def test_wheels_of_a_free_base_get_a_velocity_and_stand_on_the_ground(new):
    folder, made, task, told = new(
        "my_wheels", robot(*ROVER), "--base", "free", "--passive", "swivel"
    )
    assert controllers_of(folder) == {
        "left_wheel": "velocity_controllers/JointVelocityController",
        "right_wheel": "velocity_controllers/JointVelocityController",
        "pan": "effort_controllers/JointPositionController",
    }
    assert "get a velocity controller, as wheels: left_wheel, right_wheel" in told
    assert "without a motor, and that tasks don't see: swivel" in told
    assert made.pose.position == (0.0, 0.0, 0.15)  # hubs 5 cm below the base, wheels of 10 cm
    assert "spawned at a height of 0.15 m; its lowest collision touches" in told
    assert reaches(made, task)


def test_wheels_whose_motors_give_an_effort(new):
    motors = [MOTOR.format(f"{side}_wheel", "Effort") for side in ("left", "right")]
    folder, made, task, told = new("my_torques", robot(*ROVER, *motors), "--base", "free")
    assert set(controllers_of(folder).values()) == {"effort_controllers/JointVelocityController"}
    assert "--passive" not in told  # the file says which joints have motors
    assert reaches(made, task)


def test_joints_without_end_keep_positions_where_that_is_asked_for_or_the_base_is_fixed(new):
    folder, *_ = new(
        "my_asked", robot(*ROVER), "--base", "free", "--interface", "position", "--height", "0.1"
    )
    assert set(controllers_of(folder).values()) == {"position_controllers/JointPositionController"}
    folder, *_, told = new("my_bench", robot(*ROVER), "--base", "fixed")
    assert set(controllers_of(folder).values()) == {"effort_controllers/JointPositionController"}
    assert "wheels" not in told and "height" not in told
    assert "(--passive JOINT leaves one without)" in told


def test_a_height_below_the_ground_is_told_with_one_that_is_enough(new):
    *_, told = new("my_low", robot(*ROVER), "--base", "free", "--height", "0.1")
    assert "height of 0.1 m its lowest collision lies below the ground; --height 0.15" in told
    *_, told = new("my_ghost", robot(*BARE), "--base", "free")
    assert "falls through the ground" in told


def test_the_lowest_point_of_all_shapes(tmp_path):
    (tmp_path / "rod.stl").write_bytes(binary_stl())
    for shape, height, tilted in (
        ('<sphere radius="0.1"/>', 0.1, 0.1),
        ('<cylinder radius="0.1" length="0.4"/>', 0.2, 0.3 * 0.5**0.5),
        ('<box size="1 1 0.3"/>', 0.15, 0.65 * 0.5**0.5),
        (f'<mesh filename="{tmp_path}/rod.stl" scale="1 1 0.5"/>', 0.5, 1.5 * 0.5**0.5),
    ):
        found = f"<collision><geometry>{shape}</geometry></collision>"
        assert standing_height(parse_urdf(robot(LINK.format("base", found)))) == height
        origin = '<origin xyz="0 0 -1" rpy="0.7853981633974483 0 0"/>'
        turned = found.replace("<geometry", f"{origin}<geometry")
        low = standing_height(parse_urdf(robot(LINK.format("base", turned))))
        assert 0.999999 + tilted <= low < 1.001 + tilted


def test_a_namespace_of_the_plugin(new):
    text = robot(
        *BARE,
        FIXED,
        MOTOR.format("swing", "Effort"),
        PLUGIN.format("<robotNamespace>/one</robotNamespace>"),
    )
    folder, made, task, _ = new("my_named", text)
    assert made.namespace == "one"
    assert 'ns="/one"' in (folder / "launch/simulation.launch").read_text()
    assert reaches(made, task)


def test_limits_of_0_which_exporters_write_are_lifted_and_told(new):
    zero = JOINT.format(
        "swing", "revolute", "base", "rod", '<limit lower="-1" upper="1" effort="0" velocity="0"/>'
    )
    _, made, task, told = new("my_export", robot(*BARE[:2], zero, FIXED))
    assert "limits of effort and velocity that are 0 would hold swing" in told
    assert reaches(made, task)


def test_a_joint_without_a_motor_stays_so_and_is_told(new):
    text = robot(
        *BARE, FIXED, LINK.format("tail", ""), JOINT.format("hinge", "continuous", "rod", "tail", ""),
        MOTOR.format("swing", "Effort"), PLUGIN.format(""),
    )  # fmt: skip
    _, made, _, told = new("my_tail", text)
    assert made.joints == ("swing",)
    assert "without a motor, and that tasks don't see: hinge" in told


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


def test_meshes_of_a_package_that_was_downloaded_without_its_package_xml_come_along(new, tmp_path):
    for kind in ("visual", "collision"):  # of one name
        (tmp_path / "arm_files/meshes" / kind).mkdir(parents=True)
        (tmp_path / "arm_files/meshes" / kind / "rod.stl").write_bytes(binary_stl(len(kind)))
    shapes = "".join(
        f'<{kind}><geometry><mesh filename="package://arm_files/meshes/{kind}/rod.stl"/></geometry></{kind}>'
        for kind in ("visual", "collision")
    )
    (tmp_path / "arm_files/urdf").mkdir()
    urdf = tmp_path / "arm_files/urdf/arm.urdf"
    urdf.write_text(robot(BARE[0], LINK.format("rod", shapes), SWING, FIXED))
    folder, made, *_ = new("my_download", urdf)
    for kind in ("visual", "collision"):
        copy = folder / "meshes/arm_files" / kind / "rod.stl"
        assert copy.read_bytes() == binary_stl(len(kind))
    assert made.links.links["rod"].collisions[0].mesh == str(copy)


def test_a_package_that_it_needs_is_depended_on(new, tmp_path, monkeypatch):
    other = tmp_path / "ws/their_description"
    (other / "urdf").mkdir(parents=True)
    (other / "package.xml").write_text("<package><name>their_description</name></package>")
    (other / "urdf/links.xacro").write_text(robot(LINK.format("base", "") + LINK.format("rod", "")))
    urdf = other / "urdf/arm.urdf.xacro"
    urdf.write_text(
        robot(
            '<xacro:include filename="$(find their_description)/urdf/links.xacro"/>', SWING, FIXED
        )
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}/ws:{os.environ['ROS_PACKAGE_PATH']}")
    monkeypatch.setenv("CARTPOLE_WITH", str(tmp_path / "ws"))
    folder, made, _, told = new("my_described", urdf)
    made.check()
    assert "<exec_depend>their_description</exec_depend>" in (folder / "package.xml").read_text()
    assert f"./ws --with {tmp_path}/ws --with " in told


@pytest.mark.parametrize(
    ("text", "arguments", "words"),
    [
        (robot(*BARE), [], "nothing fixes its link 'base' to the world: --base fixed"),
        (robot(LINK.format("base", "")), ["--base", "fixed"], "nothing in it moves"),
        ("<robot", [], "robot.urdf"),
        ("", [], "robot.urdf"),
        ("<sdf version='1.6'/>", [], "not <robot>"),
        (robot(*BARE, "<xacro:include filename='none.xacro'/>"), [], "none.xacro"),
        (robot(*BARE, "${nothing}"), [], "nothing"),
        (robot(*BARE, FIXED, MOTOR.format("swung", "Effort")), [], "transmission of joint 'swung'"),
        (robot(*BARE, FIXED, MOTOR.format("swing", "Hydraulic")), [], "HydraulicJointInterface"),
        (
            robot(*BARE[:2], FIXED, SWING.replace('lower="-1" upper="2" ', "")),
            [],
            "joint 'swing' can't move: lower and upper",
        ),
        (
            robot(BARE[0], SWING, FIXED, LINK.format("rod", NOBODYS)),
            [],
            "the package 'nobodys', which isn't found: ./ws --with FOLDER",
        ),
        (robot(*BARE, FIXED), ["size=3"], "NAME:=VALUE"),
        (robot(*BARE, FIXED), ["--height", "nan"], "--height"),
        (robot(*BARE, FIXED), ["--passive", "swign"], "did you mean 'swing'?"),
        (robot(*BARE, FIXED), ["--passive", "swing"], "nothing in it moves by a motor"),
        (
            robot(*BARE, FIXED, MOTOR.format("swing", "Effort")), ["--passive", "swing"],
            "for files without transmissions",
        ),
    ],
)  # fmt: skip
def test_a_robot_that_can_not_be_used_is_one_line(tmp_path, capsys, text, arguments, words):
    (tmp_path / "robot.urdf").write_text(text)
    command = ["my_bad", "--urdf", str(tmp_path / "robot.urdf"), "--to", str(tmp_path), *arguments]
    assert main(command) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("new_robot: ") and words in line, line
    assert [path.name for path in tmp_path.iterdir()] == ["robot.urdf"], "nothing is left behind"


@pytest.mark.parametrize(
    ("name", "better"),
    [
        ("My-Arm", "my_arm"),
        ("MyArm", "my_arm"),
        ("3dof arm", "my_3dof_arm"),
        ("class", "my_class"),
        ("cartpole", "my_cartpole"),
        ("gazebo_msgs", "my_gazebo_msgs"),
        ("random", "my_random"),
        ("рука", "robot"),
        ("", "robot"),
    ],
)
def test_a_name_that_can_not_be_is_told_with_one_that_can(tmp_path, capsys, name, better):
    assert main([name, "--to", str(tmp_path)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(f"'{better}' would do", line), line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("there", ["folder", "file", "link"])
def test_nothing_is_overwritten(tmp_path, capsys, there):
    place = tmp_path / "my_arm"
    {"folder": place.mkdir, "file": place.touch, "link": lambda: place.symlink_to("nowhere")}[
        there
    ]()
    assert main(["my_arm", "--to", str(tmp_path)]) == 1
    assert "is there already" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["my_arm"]


def test_places_that_can_not_be(tmp_path, capsys):
    assert main(["my_arm", "--to", str(tmp_path / "none")]) == 1
    assert f"there is no folder {tmp_path}/none" in capsys.readouterr().err
    assert main(["my_arm", "--urdf", str(tmp_path / "no.urdf"), "--to", str(tmp_path)]) == 1
    assert f"{tmp_path}/no.urdf" in capsys.readouterr().err


def test_it_is_written_beside_the_checkout(root, tmp_path, monkeypatch, capsys):
    assert root.parent == package.PARENT
    monkeypatch.setattr(package, "PARENT", tmp_path)
    monkeypatch.setattr(package, "TREE", tmp_path / "cartpole")
    assert main(["my_arm"]) == 0
    told = capsys.readouterr().out
    page = (root / "docs/tutorial_robot.md").read_text()
    commands = re.findall(r"^  (\./ws .*?)(?:    #.*)?$", told, re.MULTILINE)
    assert len(commands) == 7
    assert [each for each in commands if each not in page] == [], "those of the tutorial"


@pytest.mark.extras("stable_baselines3")
@pytest.mark.parametrize("algo", ["ppo", "sac"])
def test_its_options_are_those_of_trainings(new, algo, tmp_path):
    folder, *_ = new(f"my_{algo}")
    flags = ["--config", str(folder / f"config/{algo}.yaml"), "--env-id", f"my_{algo}/Reach-v0"]
    options = choose(algorithm(algo), flags)
    given = yaml.safe_load((folder / f"config/{algo}.yaml").read_text())
    assert options.run.total_timesteps == given["total_timesteps"]
    assert options.run.num_envs == 1


def test_its_test_holds_for_a_task_that_takes_the_place_of_reach(new):
    """Who follows the README's list of what goes together has a package that works."""
    folder, *_ = new("my_other")
    (folder / "src/my_other/tasks.py").write_text(
        (folder / "src/my_other/tasks.py")
        .read_text()
        .replace("RANGES", "SPANS")
        .replace("Reach", "Hold")
    )
    named = ("src/my_other/environment.py", "test/test_environment.py", "launch/train.launch")
    for place in named:
        text = (folder / place).read_text()
        assert "Reach" in text
        (folder / place).write_text(text.replace("Reach", "Hold"))
        assert place.rpartition("/")[2] in (folder / "README.md").read_text()
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", folder / "test"],
        cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": f"{folder}/src:{os.environ.get('PYTHONPATH', '')}"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
