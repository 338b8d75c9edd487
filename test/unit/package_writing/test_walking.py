"""new_robot.py --task walk: legs walk where a command says."""

import dataclasses
import importlib
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from package_writing.cli import main
from package_writing.standing import gait
from robot_envs import LinkQuery, StateQuery
from robot_envs.backends import make_backend
from robot_envs.scene import Scene
from robot_envs.testing import check_robot_env
from robot_envs.world_state import InitialState
from robot_sim.applied_forces import ActingTime, AppliedWrench
from robot_sim.physics.files.urdf import parse_urdf

QUADRUPED = Path(__file__).resolve().parents[2] / "data/robots/quadruped.urdf"
ARM = "urdf/two_link_arm.urdf.xacro"


@pytest.mark.slow
def test_a_quadruped_trots_by_commands(new):
    folder, robot, task, told = new("my_walker", QUADRUPED, "--base", "free", "--task", "walk")
    assert "my_walker.environment:my_walker/Walk-v0 --config" in told and "--algo ppo" in told
    made = task()
    pairs = dict(zip(made.feet, made.gait.phases.tolist(), strict=True))
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
    assert "num_envs: 8" in (folder / "config/ppo.yaml").read_text()
    assert robot.control_period == 0.02


def test_what_has_no_legs_is_refused(tmp_path, capsys):
    words = ["--urdf", ARM, "--base", "fixed", "--task", "walk", "--to", str(tmp_path)]
    assert main(["my_wheels", *words]) == 1
    assert "--task walk: it has no legs" in capsys.readouterr().err


@pytest.mark.parametrize(
    "legs",
    [
        {"left": (0, 1, 0.0), "right": (0, -1, 0.5)},
        {"l1": (2, 1, 0.0), "l2": (0, 1, 0.5), "l3": (-2, 1, 0.0),
         "r1": (2, -1, 0.5), "r2": (0, -1, 0.0), "r3": (-2, -1, 0.5)},
    ],
    ids=["two step in turn", "six walk on three"],
)  # fmt: skip
def test_the_gait_of_legs_is_by_where_they_stand(legs):
    mass = """<inertial><mass value="1"/>
        <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>"""
    parts = "".join(
        f'''<link name="{name}">{mass}</link><joint name="{name}_joint" type="revolute"><parent link="trunk"/>
        <child link="{name}"/><origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'''
        for name, (x, y, _) in legs.items()
    )
    model = parse_urdf(f'<robot name="r"><link name="trunk">{mass}</link>{parts}</robot>')
    assert gait(model, list(legs)) == {name: phase for name, (_, _, phase) in legs.items()}


ROOT = Path(__file__).resolve().parents[3]
PUSHED, OVER = 5.0, 10.0  # [s]
WALKERS = {  # joints and mass [kg]
    ("biped",): (29, 42.6),
    ("quadruped", "abduction:=false"): (8, 12.4),
    ("quadruped",): (12, 12.4),
    ("quadruped", "size:=1.5"): (12, 41.9),
    ("biped", "arms:=false"): (12, 22.4),
    ("biped", "arms:=false", "size:=0.8"): (12, 11.5),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "file, arguments",
    [
        pytest.param(*each[:1], each[1:], marks=() if number < 2 else pytest.mark.long, id=" ".join(each))
        for number, each in enumerate(WALKERS)
    ],
)
def test_it_stands_at_first_launch_and_under_a_push(new, tmp_path, file, arguments):
    """For 10 s, on both engines, with 10 % of the weight for 0.1 s ahead and aside."""
    urdf = ROOT / f"urdf/{file}.urdf.xacro"
    folder, robot, *_ = new("my_legs", urdf, *arguments, "--base", "free")
    stance = importlib.import_module("my_legs.robot").STANCE
    mass = sum(each.inertia.mass for each in robot.links.links.values() if each.inertia)
    assert (len(robot.joints), round(mass, 1)) == WALKERS[file, *arguments]
    force, root = 0.1 * 9.81 * mass, robot.links.root
    for engine in ("bullet", "mujoco")[: 2 if importlib.util.find_spec("mujoco") else 1]:
        scene = Scene([dataclasses.replace(robot, engine=engine)])
        world = make_backend(scene, None, robot.control_period)
        world.look(StateQuery(links=(LinkQuery(root),)))
        start = world.reset(InitialState(joints=stance)).links[root].pose.position[2]
        heights = []
        for step in range(round(OVER / robot.control_period)):
            if step == round(PUSHED / robot.control_period):
                push(world, robot.model, root, (force, force, 0.0))
            heights.append(world.act({}).links[root].pose.position[2])
        world.close()
        assert min(heights) > 0.97 * start and heights[-1] == pytest.approx(start, rel=0.01)


def push(world, model, link, force):
    sim = world._sim
    time = ActingTime(sim.now, 100_000_000)  # [ns]
    wrench = force, (0.0, 0.0, 0.0)
    sim.applied.wrenches.append(AppliedWrench(sim.world.models[model], link, wrench, time))
