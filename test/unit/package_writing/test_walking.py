"""new_robot.py --task walk: legs walk where a command says."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest

from package_writing.cli import main
from package_writing.standing import gait
from robot_envs.testing import check_robot_env
from robot_sim.physics.files.urdf import parse_urdf

QUADRUPED = Path(__file__).resolve().parents[2] / "data/robots/quadruped.urdf"
ARM = "urdf/two_link_arm.urdf.xacro"


@pytest.mark.slow
def test_a_quadruped_trots_by_commands(new):
    folder, robot, task, told = new("my_walker", QUADRUPED, "--base", "free", "--task", "walk")
    assert "my_walker.environment:my_walker/Walk-v0 --config" in told and "--algo sac" in told
    made = task()
    pairs = dict(zip(made.feet, made.phases, strict=True))
    assert pairs["front_left_calf"] == pairs["rear_right_calf"] != pairs["front_right_calf"]
    assert pairs["front_right_calf"] == pairs["rear_left_calf"]
    assert made.imu is None  # the file has none
    check_robot_env("my_walker.environment:my_walker/Walk-v0", steps=40)
    env = gymnasium.make("my_walker.environment:my_walker/Walk-v0").unwrapped
    env.reset(seed=0)
    env.task.aim((0.0, 0.0, 0.0))
    for _ in range(150):
        *_, terminated, _, info = env.step(np.zeros(env.action_space.shape, np.float32))
    assert not terminated and info["rewards"]["linear"] > 0.95
    assert info["rewards"]["height"] < 0.01
    env.close()
    assert (folder / "config/sac.yaml").exists() and robot.control_period == 0.02


def test_what_has_no_legs_is_refused(tmp_path, capsys):
    code = main(
        ["my_wheels", "--urdf", ARM, "--base", "fixed", "--task", "walk", "--to", str(tmp_path)]
    )
    assert code == 1 and "--task walk: it has no legs" in capsys.readouterr().err


@pytest.mark.parametrize(
    "places, phases",
    [
        ({"left": (0, 1), "right": (0, -1)}, {"left": 0.0, "right": 0.5}),
        (
            {
                "l1": (2, 1),
                "l2": (0, 1),
                "l3": (-2, 1),
                "r1": (2, -1),
                "r2": (0, -1),
                "r3": (-2, -1),
            },
            {"l1": 0.0, "l2": 0.5, "l3": 0.0, "r1": 0.5, "r2": 0.0, "r3": 0.5},
        ),
    ],
    ids=["two step in turn", "six walk on three"],
)
def test_the_gait_of_legs_is_by_where_they_stand(places, phases):
    mass = """<inertial><mass value="1"/>
        <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>"""
    legs = "".join(
        f'''<link name="{name}">{mass}</link><joint name="{name}_joint" type="revolute"><parent link="trunk"/>
        <child link="{name}"/><origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'''
        for name, (x, y) in places.items()
    )
    model = parse_urdf(f'<robot name="r"><link name="trunk">{mass}</link>{legs}</robot>')
    assert gait(model, list(places)) == phases
