"""new_robot.py: what it refuses in one line, and leaves as it was."""

from __future__ import annotations

import pytest
from support.robots.new_robots import BARE, FIXED, JOINT, LIMIT, LINK, MOTOR, NOBODYS, PLUGIN, SWING, robot
from support.robots.vehicles import two_wheels

from package_writing.cli import main

MAST = "".join((LINK.format("mast", ""), JOINT.format("diff_drive", "revolute", "base", "mast", LIMIT),
                MOTOR.format("diff_drive", "Effort"), "</robot>"))  # fmt: skip


@pytest.mark.parametrize(
    ("text", "arguments", "words"),
    [
        (robot(*BARE), [], "nothing fixes its link 'base' to the world: --base fixed"),
        (robot(LINK.format("base", "")), ["--base", "fixed"], "nothing in it moves"),
        (robot(*BARE, JOINT.format("back", "fixed", "rod", "base", "")), [], "['base', 'rod'] form a ring"),
        ("<sdf version='1.6'/>", [], "not <robot>"),
        (robot(*BARE, "<xacro:include filename='none.xacro'/>"), [], "none.xacro"),
        (robot(*BARE, FIXED, MOTOR.format("swung", "Effort")), [], "transmission of joint 'swung'"),
        (robot(*BARE, FIXED, MOTOR.format("swing", "Hydraulic")), [], "HydraulicJointInterface"),
        (robot(*BARE[:2], FIXED, SWING.replace('lower="-1" upper="2" ', "")), [],
         "joint 'swing' can't move: lower and upper"),
        (robot(BARE[0], SWING, FIXED, LINK.format("rod", NOBODYS)), [],
         "the package 'nobodys', which isn't found: ./ws --with FOLDER"),
        (robot(*BARE, FIXED, LINK.format("end", ""), JOINT.format("a b", "revolute", "rod", "end", LIMIT))
         .replace("swing", "a_b"), [], "would share the controller a_b_controller"),
        (robot(*BARE, FIXED).replace("swing", "joint_state"), [],
         'the controller of the joint "joint_state" would be called joint_state_controller'),
        (two_wheels().replace("</robot>", MAST), ["--base", "free"],
         'the joint "diff_drive" would be called diff_drive_controller, as another one is'),
        (robot(*BARE, FIXED, PLUGIN.format("<robotNamespace>a b</robotNamespace>")), [], "'a b'"),
        (robot(*BARE, FIXED).replace('value="0.5"', 'value="1e30"'), [], "can't take a step"),
        (robot(*BARE, FIXED).replace("swing", "sw\x7fing"), [], r"rename the joint 'sw\x7fing'"),
        (robot(*BARE, FIXED).replace('lower="-1" upper="2"', 'lower="0" upper="1e308"'), [],
         "'swing' can't move from 0 to 1e+308"),
        (robot(*BARE, FIXED), ["size=3"], "NAME:=VALUE"),
        (robot(*BARE, FIXED), ["--height", "nan"], "--height"),
        (robot(*BARE, FIXED), ["--passive", "swign"], "did you mean 'swing'?"),
        (robot(*BARE, FIXED, MOTOR.format("swing", "Effort")), ["--passive", "swing"],
         "for files without transmissions"),
    ],
)  # fmt: skip
def test_a_robot_that_can_not_be_used_is_one_line(tmp_path, capsys, text, arguments, words):
    (tmp_path / "robot.urdf").write_text(text)
    command = ["my_bad", "--urdf", str(tmp_path / "robot.urdf"), "--to", str(tmp_path), *arguments]
    assert main(command) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("new_robot: ") and words in line, line
    assert [path.name for path in tmp_path.iterdir()] == ["robot.urdf"], "nothing is left behind"


def test_a_file_named_as_the_packages_own_is_refused(tmp_path, capsys):
    source = tmp_path / "my_arm_control.urdf.xacro"
    source.write_text(robot(*BARE, FIXED))
    assert main(["my_arm", "--urdf", str(source), "--to", str(tmp_path)]) == 1
    assert "has a urdf/my_arm_control.urdf.xacro of its own" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "near"),
    [("MyArm", "my_arm"), ("3dof arm", "my_3dof_arm"), ("class", "my_class"), ("рука", "my_robot")],
)
def test_a_name_that_can_not_be_is_refused_with_one_that_can(tmp_path, capsys, name, near):
    assert main([name, "--to", str(tmp_path)]) == 1
    assert f"'{name}' isn't one; '{near}' would do" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["cartpole", "gazebo_msgs", "random"])
def test_a_name_that_is_taken_is_refused(tmp_path, capsys, name):
    assert main([name, "--to", str(tmp_path)]) == 1
    assert f"the name '{name}' is taken; 'my_{name}' would do" in capsys.readouterr().err


@pytest.mark.parametrize("there", ["folder", "file", "link"])
def test_nothing_is_overwritten(tmp_path, capsys, there):
    place = tmp_path / "my_arm"
    link = lambda: place.symlink_to("nowhere")  # noqa: E731
    {"folder": place.mkdir, "file": place.touch, "link": link}[there]()
    assert main(["my_arm", "--to", str(tmp_path)]) == 1
    assert "is there already" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["my_arm"]


def test_places_that_can_not_be(tmp_path, capsys):
    assert main(["my_arm", "--to", str(tmp_path / "none")]) == 1
    assert f"there is no folder {tmp_path}/none" in capsys.readouterr().err
    assert main(["my_arm", "--urdf", str(tmp_path / "no.urdf"), "--to", str(tmp_path)]) == 1
    assert f"{tmp_path}/no.urdf" in capsys.readouterr().err
