"""new_robot.py: wheels of a free base, and the height at which it stands."""

from __future__ import annotations

import pytest
import yaml
from support.mutations.mesh_files import binary_stl
from support.robots.new_robots import (
    BARE,
    JOINT,
    LIMIT,
    LINK,
    MOTOR,
    reaches,
    robot,
)

from bullet_gazebo.physics.files.urdf import parse_urdf
from package_writing.survey import standing_height

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


@pytest.mark.slow
def test_joints_without_end_keep_positions_where_that_is_asked_for_or_the_base_is_fixed(new):
    folder, *_ = new(
        "my_asked", robot(*ROVER), "--base", "free", "--interface", "position", "--height", "0.1"
    )
    assert set(controllers_of(folder).values()) == {"position_controllers/JointPositionController"}
    folder, *_, told = new("my_bench", robot(*ROVER), "--base", "fixed")
    assert set(controllers_of(folder).values()) == {"effort_controllers/JointPositionController"}
    assert "wheels" not in told and "height" not in told
    assert "(--passive JOINT leaves one without)" in told


@pytest.mark.slow
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
        assert standing_height(parse_urdf(robot(LINK.format("base", found))), {}) == height
        origin = '<origin xyz="0 0 -1" rpy="0.7853981633974483 0 0"/>'
        turned = found.replace("<geometry", f"{origin}<geometry")
        low = standing_height(parse_urdf(robot(LINK.format("base", turned))), {})
        assert 0.999999 + tilted <= low < 1.001 + tilted
