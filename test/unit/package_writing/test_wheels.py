"""new_robot.py: wheels of a free base, and the height at which it stands."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from support.mutations.mesh_files import binary_stl
from support.robots.new_robots import BARE, JOINT, LIMIT, LINK, MOTOR, reaches, robot
from support.robots.vehicles import TRACK, four_wheels, three_wheels, two_wheels, wheel

from package_writing.standing import standing_height
from package_writing.survey import look_at
from package_writing.vehicle import DRIVE, Base, find_base
from robot_envs import RobotEnv
from robot_envs.files import resources
from robot_sim.physics.files.urdf import parse_urdf

ROUND = """<collision><origin rpy="1.5707963267948966 0 0"/><geometry>
<cylinder radius="0.1" length="0.04"/></geometry></collision>"""
CENTRED = LINK.replace("0 0 0.1", "0 0 0")
BOX = '<collision><geometry><box size="0.3 0.2 0.06"/></geometry></collision>'
SKIDS = "".join(
    f'<collision><origin xyz="{x} 0 -0.098"/><geometry><sphere radius="0.05"/></geometry></collision>'
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

LASER_NAME = "bot1/front"
MAST = '<origin xyz="0.12 0 0.1"/>'
LASER = f"""<gazebo reference="bot1/eye"><sensor name="{LASER_NAME}" type="ray"><update_rate>10</update_rate>
<ray><scan><horizontal><samples>90</samples><min_angle>-2</min_angle><max_angle>2</max_angle></horizontal></scan>
<range><min>0.05</min><max>8</max></range></ray><plugin name="l" filename="libgazebo_ros_laser.so">
<robotNamespace>bot1</robotNamespace><topicName>front_scan</topicName></plugin></sensor></gazebo>"""
FORK = '<collision><geometry><box size="0.01 0.01 0.01"/></geometry></collision>'
ROLLER = ROUND.replace("0.1", "0.05").replace("0.04", "0.02")
PREFIXED = robot(
    CENTRED.format("bot1/base", BOX), LASER, LINK.format("bot1/eye", ""),
    *(CENTRED.format(f"bot1/{side}", ROUND) for side in ("left", "right")),
    *(JOINT.format(f"bot1_{side}_wheel", "continuous", "bot1/base", f"bot1/{side}", HUB.format(y))
      for side, y in (("left", 0.15), ("right", -0.15))),
    CENTRED.format("bot1/fork", FORK), CENTRED.format("bot1/roller", ROLLER),
    JOINT.format("bot1_swivel", "continuous", "bot1/base", "bot1/fork", '<origin xyz="-0.15 0 -0.05"/>')
    .replace("0 1 0", "0 0 1"),
    JOINT.format("bot1_roller", "continuous", "bot1/fork", "bot1/roller", '<origin xyz="-0.03 0 -0.05"/>'),
    JOINT.format("bot1_mast", "fixed", "bot1/base", "bot1/eye", MAST),
)  # fmt: skip


def controllers_of(folder):
    text = (folder / "config/controllers.yaml").read_text(encoding="utf-8")
    found = yaml.safe_load(text)
    return {each["joint"]: each["type"] for each in found.values() if "joint" in each}


def drives(made, task, seed: int = 1) -> tuple[bool, np.ndarray]:
    """Whether who always turns towards the goal gets there, and the first observation."""
    env = RobotEnv(made, task())
    try:
        first = observation = env.reset(seed=seed)[0]
        done, info = False, {}
        while not done:
            cosine, sine = observation[-4:-2]
            action = np.clip([2.0 * cosine - 1.0, 3.0 * np.arctan2(sine, cosine)], -1.0, 1.0)
            observation, _, ended, late, info = env.step(action.astype(np.float32))
            done = ended or late
        return info["is_success"], first
    finally:
        env.close()


def test_two_wheels_of_a_free_base_get_a_diff_drive_controller_and_drive_to_goals(new):
    words = ("--base", "free", "--passive", "swivel")
    folder, made, task, told = new("my_wheels", robot(*ROVER), *words)
    assert controllers_of(folder) == {"pan": "effort_controllers/JointPositionController"}
    drive = yaml.safe_load((folder / "config/controllers.yaml").read_text())[DRIVE]
    assert (drive["left_wheel"], drive["right_wheel"]) == (["left_wheel"], ["right_wheel"])
    assert (drive["wheel_radius"], drive["wheel_separation"]) == (0.1, 0.3)
    assert drive["base_frame_id"] == "base"
    assert drive["linear"]["x"]["max_velocity"] == 0.6  # 20 rad/s would be 2 m/s
    launch = (folder / "launch/simulation.launch").read_text()
    assert f"joint_state_controller {DRIVE} pan_controller" in launch
    assert "left_wheel on the left and right_wheel on the right get a diff_drive" in told
    assert "--algo sac --env-id my_wheels.environment:my_wheels/Drive-v0" in told
    assert "without a motor, and that tasks don't see: swivel" in told
    assert made.pose.position == (0.0, 0.0, 0.15)  # hubs 5 cm below the base, wheels of 10 cm
    assert "spawned at a height of 0.15 m; its lowest collision touches" in told
    assert [drives(made, task, seed)[0] for seed in (1, 2)] == [True, True]


def test_a_laser_shows_the_room_in_which_a_base_with_casters_and_prefixed_names_drives(new):
    folder, made, task, told = new("my_scanner", PREFIXED, "--base", "free")
    assert "that tasks don't see: bot1_swivel, bot1_roller" in told
    assert f"uses its laser '{LASER_NAME}': what is nearer than 0.2761 m is touched" in told
    launch = (folder / "launch/simulation.launch").read_text()
    assert '<arg name="scan" value="/bot1/front_scan"/>' in launch
    assert 'default="$(find cartpole)/worlds/room.world"' in launch
    assert "room.world" in made.world and made.odometry == f"{DRIVE}/odom"
    _, first = drives(made, task)
    assert first.shape == (24 + 5,) and (first[:24] > 0.0).all()


def base_of(text: str) -> Base | None:
    return find_base(look_at(text, None, resources(), free=True))


def test_wheels_on_each_side_drive_as_one_and_other_wheels_alone():
    base = base_of(four_wheels())
    assert base is not None
    assert (base.left, base.right) == (
        ("left_front_joint", "left_rear_joint"), ("right_front_joint", "right_rear_joint"),
    )  # fmt: skip
    assert base.world == "" and base.laser is None
    assert base_of(three_wheels()) is None  # one of them on a fork
    behind = two_wheels().replace(f'"0 {0.5 * TRACK} 0"', '"0 0 0"')
    assert base_of(behind.replace(f'"0 {-0.5 * TRACK} 0"', '"0.2 0 0"')) is None
    front = wheel("front", "0.2 0 0")
    assert base_of(two_wheels().replace("</robot>", f"{front}</robot>")) is None  # an odd one
    assert base_of(two_wheels().replace('axis xyz="0 1 0"', 'axis xyz="1 0 0"')) is None


def test_a_laser_that_sees_its_own_robot_is_left_out_and_told():
    low = PREFIXED.replace(MAST, '<origin xyz="0 0 0.02"/>')
    base = base_of(low)
    assert base is not None and base.laser is None
    assert base.note == f"its laser '{LASER_NAME}' sees the robot itself"


@pytest.mark.slow
def test_wheels_that_turn_the_other_way_get_a_velocity_each(new):
    mirrored = [each.replace("0 1 0", "0 -1 0") for each in ROVER]
    words = ("--base", "free", "--passive", "swivel")
    folder, made, task, told = new("my_mirror", robot(*mirrored), *words)
    wheels = dict.fromkeys(["left_wheel", "right_wheel"], "velocity_controllers/JointVelocityController")
    pan = {"pan": "effort_controllers/JointPositionController"}
    assert controllers_of(folder) == wheels | pan
    assert "get a velocity controller, as wheels: left_wheel, right_wheel" in told
    assert reaches(made, task)


def test_wheels_whose_motors_give_an_effort(new):
    motors = [MOTOR.format(f"{side}_wheel", "Effort") for side in ("left", "right")]
    folder, made, task, told = new("my_torques", robot(*ROVER, *motors), "--base", "free")
    assert set(controllers_of(folder).values()) == {"effort_controllers/JointVelocityController"}
    assert "note: a diff_drive_controller takes velocity motors" in told
    assert "--passive" not in told  # the file says which joints have motors
    assert reaches(made, task)


@pytest.mark.slow
def test_joints_without_end_keep_positions_where_that_is_asked_for_or_the_base_is_fixed(new):
    words = ("--base", "free", "--interface", "position", "--height", "0.1")
    folder, *_ = new("my_asked", robot(*ROVER), *words)
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
