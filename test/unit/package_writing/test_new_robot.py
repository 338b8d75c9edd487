"""new_robot.py: the packages that it writes, and the robots in them."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
import yaml
from support.python import run
from support.robots.new_robots import BARE, FIXED, JOINT, LINK, MOTOR, PLUGIN, SWING, reaches, robot

from package_writing import package
from package_writing.cli import main
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.train import choose

ROBOTS = Path(__file__).resolve().parents[2] / "data/robots"


@pytest.mark.slow
def test_the_arm_that_comes_along(new):
    folder, made, task, told = new("my_arm")
    assert made.joints == ("elbow", "shoulder")
    assert reaches(made, task)
    assert f"written: {folder}" in told
    assert {path.name for path in folder.iterdir()} == {
        *("package.xml", "CMakeLists.txt", "setup.py", "README.md", ".gitignore"),
        *("config", "launch", "scripts", "src", "test", "urdf"),
    }
    texts = [path for path in folder.rglob("*.*") if path.is_file() and path.suffix != ".pyc"]
    assert len(texts) > 10 and not [path for path in texts if re.search("{[{%]", path.read_text())]
    assert oct(folder.stat().st_mode & 0o777) == oct(0o777 & ~_umask())


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


NAMES = [  # each gives its controller another name
    "123", "yes", "~", "- a", "a: b", "{x}", '"""', 'c"d', "e<f>&", "g'h", "i\\j", "#k", "${1 / 0}",
    "$(cwd)", "x\"] + [__import__('os').mkdir('owned')] + [\"",
]  # fmt: skip


@pytest.mark.slow
def test_names_of_a_file_are_data_in_what_is_written(new, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    parts = [BARE[0], FIXED]
    for number, name in enumerate(NAMES):
        swing = SWING.replace('"rod"', f'"rod{number}"')
        parts += [LINK.format(f"rod{number}", ""), swing.replace('"swing"', quoteattr(name))]
    text = robot(*parts).replace("${", "$${").replace("$(", "$$(")  # as xacro writes them
    folder, made, *_ = new("my_arm", text)
    assert sorted(made.joints) == sorted(NAMES)
    described = yaml.safe_load((folder / "config/controllers.yaml").read_text())
    assert set(NAMES) <= {each.get("joint") for each in described.values()}
    assert not (tmp_path / "owned").exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["arm", "light_hand", "slides"])
def test_robots_of_many_kinds_reach_with_the_gains_that_they_get(new, name):
    """Six joints of 17 kg, fingers of grams, slides with all three interfaces."""
    _, made, task, _ = new(f"my_{name}", ROBOTS / f"{name}.urdf")
    assert reaches(made, task)


def test_what_is_written_is_tidy(new):
    folder, *_ = new("my_tidy", ROBOTS / "slides.urdf")
    ruff = [sys.executable, "-m", "ruff"]
    options = ["--isolated", "--no-cache", "--line-length", "100"]
    for command in (["check", "--extend-select", "I,W,B,SIM,UP"], ["format", "--diff"]):
        done = run([*ruff, *command, *options], cwd=folder)
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("interface", ["effort", "position", "velocity"])
def test_transmissions_plugin_and_base_that_lack_are_added_beside(new, interface):
    words = ("--base", "fixed", "--interface", interface)
    folder, made, task, told = new(f"my_{interface}", robot(*BARE), *words)
    added = f"urdf/my_{interface}_control.urdf.xacro"
    assert added in told and (folder / added).is_file()
    assert (folder / "urdf/robot.urdf").read_text() == robot(*BARE)
    assert made.links.fixed_base and made.links.plugins
    (transmission,) = made.control.transmissions
    assert transmission.interface == f"{interface.capitalize()}JointInterface"
    assert reaches(made, task)


@pytest.mark.slow
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


def test_a_namespace_of_the_plugin(new):
    plugin = PLUGIN.format("<robotNamespace>/one</robotNamespace>")
    text = robot(*BARE, FIXED, MOTOR.format("swing", "Effort"), plugin)
    folder, made, task, _ = new("my_named", text)
    assert made.namespace == "one"
    assert 'ns="/one"' in (folder / "launch/simulation.launch").read_text()
    assert reaches(made, task)


def test_limits_of_0_which_exporters_write_are_lifted_and_told(new):
    limit = '<limit lower="-1" upper="1" effort="0" velocity="0"/>'
    zero = JOINT.format("swing", "revolute", "base", "rod", limit)
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
    assert "mimic" not in told


def test_a_joint_that_mimics_another_is_told(new):
    limit = '<limit lower="0" upper="1" effort="1" velocity="1"/><mimic joint="swing"/>'
    follower = JOINT.format("finger", "revolute", "rod", "tip", limit)
    *_, told = new("my_gripper", robot(*BARE, FIXED, LINK.format("tip", ""), follower))
    assert "joints that follow another one by <mimic>: finger\n" in told


def test_it_is_written_beside_the_checkout(root, tmp_path, monkeypatch, capsys):
    assert root.parent == package.PARENT
    monkeypatch.setattr(package, "PARENT", tmp_path)
    monkeypatch.setattr(package, "TREE", tmp_path / "cartpole")
    assert main(["my_arm"]) == 0
    told = capsys.readouterr().out
    page = (root / "docs/tutorial_robot.md").read_text()
    commands = re.findall(r"^  (\./ws .*?)(?:    #.*)?$", told, re.MULTILINE)
    assert len(commands) == 8
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


@pytest.mark.slow
def test_its_test_holds_for_a_task_that_takes_the_place_of_reach_in_a_clone(new, tmp_path):
    """Who follows the README's list of what goes together has a package that works, for others, too."""
    (tmp_path / "parts").mkdir()
    seen = '<visual><geometry><box size="0.1 0.1 0.4"/></geometry></visual>'
    (tmp_path / "parts/rod.xacro").write_text(robot(LINK.format("rod", seen)))
    parts = robot(BARE[0], FIXED, SWING, '<xacro:include filename="parts/../parts/rod.xacro"/>')
    folder, *_ = new("my_other", parts)
    tasks = folder / "src/my_other/tasks.py"
    tasks.write_text(tasks.read_text().replace("RANGES", "SPANS").replace("Reach", "Hold"))
    for place in ("src/my_other/environment.py", "launch/train.launch", "test/test_environment.py",
                  "test/simulation_node.py"):  # fmt: skip
        text = (folder / place).read_text()
        assert "Reach" in text
        (folder / place).write_text(text.replace("Reach", "Hold"))
        assert place.rpartition("/")[2] in (folder / "README.md").read_text()
    clone = tmp_path / "clone"
    for command in (
        ["init", "-q"], ["add", "."], ["-c", "user.name=a", "-c", "user.email=a@b.c", "commit", "-qm", "all"],
        ["clone", "-q", folder, clone],
    ):  # fmt: skip
        run(["git", *command], cwd=folder, check=True)
    folder.rename(tmp_path / "gone")
    assert os.access(clone / "test/simulation_node.py", os.X_OK)
    own = {"PYTHONPATH": f"{clone}/src:{os.environ.get('PYTHONPATH', '')}",
           "ROS_PACKAGE_PATH": f"{clone}:{os.environ['ROS_PACKAGE_PATH']}"}  # fmt: skip
    words = ("-m", "pytest", "-q", "-p", "no:cacheprovider", clone / "test")
    done = run([sys.executable, *words], cwd=clone, env={**os.environ, **own})
    assert done.returncode == 0, done.stdout + done.stderr
