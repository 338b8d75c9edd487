"""check_robot.py: its pages, its refusals and its exit codes."""

import json
import os
from pathlib import Path

import pytest
from support.robots.new_robots import FIXED, JOINT, LINK, MOTOR, PLUGIN, SWING, robot

from package_writing import check_page
from package_writing.check_cli import main

ROOT = Path(__file__).resolve().parents[3]
BASE, ROD = LINK.format("base", ""), LINK.format("rod", "")
BOX = '<collision><origin xyz="{0}"/><geometry><box size="0.4 0.4 0.2"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="no.stl"/></geometry></collision>'
GROUNDED = LINK.format("base", BOX.format("0 0 0.1"))


@pytest.fixture
def check(tmp_path, capfd, monkeypatch):
    """Checks files, or the text of one; returns the exit code, what is printed, and the refusals."""
    monkeypatch.setenv("ROS_PACKAGE_PATH", os.environ.get("ROS_PACKAGE_PATH", ""))

    def run(*arguments, text=None, name="robot.urdf"):
        if text is not None:
            (tmp_path / name).write_text(text)
            arguments = (tmp_path / name, *arguments)
        code = main(list(map(str, arguments)))
        told = capfd.readouterr()
        return code, told.out, told.err

    return run


def limited(limit: str) -> str:
    swing = JOINT.format("swing", "revolute", "base", "rod", f"<limit {limit}/>")
    return robot(FIXED, BASE, ROD, swing)


WEAK = limited('lower="-1" upper="1" effort="0" velocity="2"')
SOUND = robot(FIXED, BASE, ROD, SWING, MOTOR.format("swing", "Effort"), PLUGIN)


def test_a_sound_robot_is_fine_on_one_page(check):
    code, page, refused = check(text=SOUND)
    assert (code, refused) == (0, "")
    rows = dict(line.split(None, 1) for line in page.splitlines()[1:] if line)
    assert rows["model"] == "theirs: base fixed to the world"
    assert rows["mass"].startswith("1 kg")
    assert rows["plugins"] == "libgazebo_ros_control.so"
    assert rows["control"] == "1 EffortJointInterface"
    told = "held by its fixed base; commands move 1 of 1 joints"
    assert rows["PyBullet"] == rows["MuJoCo"] == told
    assert rows["verdict"] == "fine"
    assert len(page.splitlines()) < 20


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (WEAK, "the effort of its <limit> is 0"),
        (limited('lower="-1" upper="1" effort="9" velocity="0"'), "the velocity of its <limit> is 0"),
        (limited('effort="9" velocity="2"'), "the range of its <limit> is 0"),
        (
            robot(FIXED, BASE, LINK.format("rod", "").replace('"0 0 0.1"', '"1 0 0"'),
                  SWING.replace('effort="20"', 'effort="0.01"')),
            "commands don't move 'swing': 0.01 N m are too little for its load",
        ),
        (robot(BASE.replace('ixx="0.002"', 'ixx="0.9"')), "one moment of inertia exceeds the sum of"),
        (robot(BASE.replace('ixx="0.002"', 'ixx="0"')), "must be above 0"),
        (robot(GROUNDED, '<link name="rod"/>', SWING), "link 'rod' is dropped: no mass"),
        (robot(LINK.format("base", BOX.format("0.3 0 0"))), "it falls (PyBullet and MuJoCo)"),
        (robot(BASE), "it has no <collision>, so that it falls through the ground"),
        (robot(FIXED, BASE, ROD, SWING, MOTOR.format("ghost", "Effort")), "joint 'ghost': no such joint"),
    ],
)  # fmt: skip
def test_faults_of_robots_are_named(check, text, fault):
    code, page, _ = check(text=text)
    assert code == 1
    wrong = [line for line in page.splitlines() if line.startswith("  WRONG")]
    assert [line for line in wrong if fault in line], page
    assert "verdict     faults: " in page


def test_position_commands_move_joints_without_a_known_effort(check):
    text = WEAK.replace("</robot>", MOTOR.format("swing", "Position") + "</robot>")
    assert check(text=text)[0] == 0


def test_what_nothing_serves_is_a_note(check):
    more = (
        '<gazebo><plugin name="x" filename="libtheirs.so"/></gazebo><gazebo reference="base">'
        '<sensor name="eye" type="camera"/></gazebo><gazebo reference="nobody"><mu1>1</mu1></gazebo>'
    )
    code, page, _ = check(text=robot(GROUNDED, more))
    assert code == 0
    for line in (
        "  sensors     eye: camera, no plugin",
        "  note        nothing serves libtheirs.so",
        "  note        <gazebo reference='nobody'> refers to no link or joint",
        "  control     no transmissions, so no controller moves it",
    ):
        assert line in page.splitlines()


def test_controllers_are_served_or_named(check, tmp_path):
    (tmp_path / "c.yaml").write_text(
        "good: {type: effort_controllers/JointEffortController, joint: swing}\n"
        "odd: {type: effort_controllers/JointEffortControler, joint: swing}\n"
        "lost: {type: effort_controllers/JointEffortController, joint: swong}\n"
    )
    code, page, _ = check("--controllers", tmp_path / "c.yaml", text=SOUND)
    assert code == 1
    assert "1 of 3 served: good (effort_controllers/JointEffortController)" in page
    assert "did you mean 'effort_controllers/JointEffortController'?" in page
    assert "there is no joint 'swong'; did you mean 'swing'?" in page
    (tmp_path / "other.yaml").write_text("bot: {good: {type: x/Y}}")
    code, page, _ = check("--controllers", tmp_path / "other.yaml", text=SOUND)
    assert code == 1 and "other.yaml has no controller outside of namespaces" in page
    code, page, refused = check("--controllers", tmp_path / "none.yaml", text=SOUND)
    assert (code, page) == (2, "") and "none.yaml" in refused and refused.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "text", "fault"),
    [
        ("x.urdf", '<robot name="x"><link></robot>', "mismatched tag"),
        ("x.urdf.xacro", robot('<link name="${nope}"/>'), "name 'nope' is not defined"),
        ("x.urdf", robot(LINK.format("a", ""), LINK.format("b", "")), "x.urdf: model 'theirs': "),
        ("x.sdf", "<sdf version='1.6'><light name='l' type='point'/></sdf>", "describes a light"),
        ("x.world", "<sdf version='1.6'/>", "there is no <model>"),
        ("x.urdf", robot(LINK.format("base", MESH)), "'no.stl' is not found"),
    ],
)
def test_a_file_that_cannot_be_used_is_one_line(check, name, text, fault):
    code, page, refused = check(text=text, name=name)
    assert (code, page) == (2, "")
    assert fault in refused and refused.startswith("check_robot: ") and refused.count("\n") == 1


@pytest.mark.parametrize("given", ["nowhere.urdf", "no_such_package", "package://no_such_package/a.urdf"])
def test_what_is_not_there_is_one_line(check, given):
    assert check(given) == (2, "", f"check_robot: {given}: there is no such file or package\n")


def test_several_files_have_a_page_each_and_the_worst_code(check, tmp_path):
    (tmp_path / "a.urdf").write_text(robot(GROUNDED))
    (tmp_path / "b.urdf").write_text(WEAK)
    code, page, _ = check(tmp_path / "a.urdf", tmp_path / "b.urdf")
    assert (code, page.count("verdict")) == (1, 2)
    code, page, refused = check(tmp_path / "b.urdf", tmp_path / "none.urdf", tmp_path / "a.urdf")
    assert (code, page.count("verdict"), refused.count("\n")) == (2, 2, 1)


def test_a_package_is_found_by_its_checkout_and_its_parts_are_no_robots(check, tmp_path):
    """It isn't on ROS_PACKAGE_PATH: it lies as git has cloned it."""
    package = tmp_path / "their_repo/their_robot"
    (package / "urdf").mkdir(parents=True)
    (tmp_path / "their_repo/.git").mkdir()
    (package / "package.xml").write_text("<package><name>their_robot</name></package>")
    (package / "urdf/parts.xacro").write_text(robot('<xacro:macro name="part" params="mass"/>'))
    (package / "urdf/needs.xacro").write_text(robot('<link name="${given_by_another_file}"/>'))
    argument = '<xacro:arg name="link" default="base"/>'
    include = '<xacro:include filename="$(find their_robot)/urdf/parts.xacro"/>'
    arm = robot(argument, include, GROUNDED.replace('"base"', '"$(arg link)"'))
    (package / "urdf/arm.urdf.xacro").write_text(arm)
    code, page, refused = check(package, "link:=foot")
    assert (code, page.count("verdict")) == (0, 1)
    assert [line.split(": ")[1] for line in refused.splitlines()] == ["passed over"] * 2
    assert "urdf/arm.urdf.xacro\n" in page
    assert check("their_robot")[0] == 0
    (package / "urdf/arm.urdf.xacro").unlink()
    code, page, refused = check(package)
    assert (code, page) == (2, "") and "is a robot by itself" in refused


def test_sdf_and_worlds(check):
    code, page, _ = check(ROOT / "test/data/models/crate", ROOT / "worlds/room.world")
    assert code == 0
    assert "  world       room; models: ground_plane, walls, boxes" in page.splitlines()
    assert page.count("nothing blows up") == 2 and "  model       crate: base free" in page


def test_moments_that_sdf_leaves_out_are_its_own_and_static_ones_do_not_matter(check):
    link = (
        "<link name='l'><inertial><inertia><ixx>{0}</ixx></inertia></inertial><collision name='c'>"
        "<geometry><box><size>1 1 1</size></box></geometry></collision></link>"
    )
    for moment, static, code in ((1, 0, 0), (0, 0, 1), (0, 1, 0)):
        text = f"<model name='m'><static>{static}</static>{link.format(moment)}</model>"
        assert check(text=f"<sdf version='1.6'>{text}</sdf>", name="m.sdf")[0] == code


def test_a_model_that_a_world_lacks_is_a_fault(check):
    code, page, _ = check(ROOT / "test/data/worlds/boxes.world")
    assert code == 1
    assert "  WRONG       model 'broken': link 'l': <pose> must hold 6 numbers" in page
    assert "  note        nothing serves libnobody_has_this.so" in page.splitlines()


def test_json_has_the_same(check):
    code, printed, _ = check("--json", text=robot(GROUNDED))
    (page,) = json.loads(printed)
    assert code == 0 and page["lines"]["model"] == "theirs: base free" and page["wrong"] == []


def test_without_mujoco_it_says_so(check, monkeypatch):
    engines = {"pybullet": "bullet", "no_such_module": "mujoco"}
    monkeypatch.setattr(check_page, "ENGINES", engines)
    code, page, _ = check(text=robot(GROUNDED))
    assert code == 0 and "not tried with MuJoCo: " in page and "  PyBullet    stands" in page


@pytest.mark.parametrize("name", ["six_joint_arm", "rover", "hopper", "gripper_arm"])
def test_our_robots_are_fine(check, name):
    code, page, _ = check(ROOT / f"urdf/{name}.urdf.xacro")
    assert code == 0, page


def test_joints_of_a_closed_loop_move_together(check):
    _, page, _ = check(ROOT / "test/data/robots/four_bar_gripper.urdf")
    assert page.count("commands move 7 of 7 joints") == 2
