"""The architecture (docs/architecture.md), beside the contracts of pyproject.toml: one name for one thing."""

import ast
import re
import tomllib
from collections import defaultdict
from pathlib import Path

import pytest
from support.python import loaded_by, run_python

from lockstep_runner.script import LIBRARIES, WALL_TIME

SRC = Path(__file__).resolve().parents[3] / "src"
ROOT = SRC.parent
MODULES = sorted(SRC.rglob("*.py"))
LEARNING = {"gymnasium", "torch", "stable_baselines3", "matplotlib"}
MOST_ENTRIES = 25
MOST_DOUBLE_CLASSES = 3
ROS = ("rospy", "rosgraph", "rosnode", "roslib", "rosparam", "roslaunch", "rosservice")
LINTER = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
LAYERS = [set(layer.split(" | ")) for layer in LINTER["contracts"][0]["layers"]]
# What still names higher libraries.
NAMING = {"robot_sim/physics/engines/__init__.py"}
WITHOUT_ROS = (
    "robot_sim.physics.world",
    "robot_sim.control.manager",
    "robot_sim.simulator",
    "cartpole.pg_train",
    "cartpole.workbench",
    "rl_workbench.cli",
    "rl_workbench.training.training",
    "robot_envs.backends.in_process",
    "robot_envs.environment",
)


def test_the_contracts_speak_of_all_libraries() -> None:
    libraries = {path.parent.name for path in SRC.glob("*/__init__.py")}
    assert libraries == set(LINTER["root_packages"]) == set().union(*LAYERS)


def test_a_wait_in_our_libraries_stays_wall_time_under_the_lockstep_runner() -> None:
    files = [each for each in SRC.glob("*/__init__.py") if WALL_TIME in each.read_text()]
    marked = {each.parent.name for each in files}
    assert set(LINTER["root_packages"]) <= marked | LIBRARIES


@pytest.mark.parametrize("place", range(1, len(LAYERS)))
def test_no_string_names_a_higher_library(place: int) -> None:
    """A module of it: the package for ROS is called cartpole, too."""
    higher = set().union(*LAYERS[:place])
    named = re.compile(rf"\b(cartpole[./]\w|({'|'.join(higher - {'cartpole'})})\b)")
    found = {
        str(path.relative_to(SRC))
        for path in MODULES
        if path.relative_to(SRC).parts[0] in LAYERS[place]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and named.search(str(node.value))
    }
    assert found <= NAMING


@pytest.mark.slow
def test_only_the_rooms_for_it_ask_for_ros() -> None:
    """What is made for this process alone works where no ROS is installed."""
    script = f"""
import sys
class NoRos:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {(*ROS, "genpy", "rospkg", "std_msgs", "gazebo_msgs")!r}:
            raise ModuleNotFoundError(f"no ROS here: {{name}}", name=name)
sys.meta_path.insert(0, NoRos())
for name in {WITHOUT_ROS!r}:
    __import__(name)
"""
    environment = {"PYTHONPATH": str(SRC), "PATH": "/usr/bin:/bin"}
    done = run_python(script, check=False, env=environment)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("modules", "absent"),
    [
        ("bullet_gazebo.node.gzserver", LEARNING),
        ("bullet_gazebo.clients.gz", {"rospy", *LEARNING}),
        ("robot_sim.simulator", LEARNING),
        ("ros_calls.master", {"rospy"}),
        ("ros_calls.service, ros_calls.waiting", {"std_srvs"}),  # nor is a master needed
        ("cartpole", {"pybullet", "rospy", "torch", "xacro", "robot_envs"}),
        ("cartpole.policy_node", {"torch"}),
    ],
)
def test_an_import_leaves_out_what_takes_seconds(modules: str, absent: set[str], monkeypatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    assert not loaded_by(modules) & absent


def test_no_folder_is_crowded() -> None:
    entries: dict[Path, set[str]] = defaultdict(set)
    for path in (each for each in MODULES if each.name[:2] != "__"):
        for folder in path.relative_to(SRC).parents:  # a folder that git has left behind is none
            entries[folder].add(path.relative_to(SRC / folder).parts[0])
    assert {str(each) for each, names in entries.items() if len(names) > MOST_ENTRIES} == set()


def test_a_name_means_one_class() -> None:
    places: dict[str, set[str]] = defaultdict(set)
    for path in MODULES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].add(str(path.relative_to(SRC)))
    doubles = {name: sorted(found) for name, found in places.items() if len(found) > 1}
    assert len(doubles) <= MOST_DOUBLE_CLASSES, doubles


def test_a_name_means_one_module_of_a_library() -> None:
    places: dict[tuple[str, str], list[str]] = defaultdict(list)
    for path in MODULES:
        name = str(path.relative_to(SRC))
        if not path.name.startswith("__"):
            places[name.split("/", maxsplit=1)[0], path.stem].append(name)
    doubles = {"/".join(key): found for key, found in places.items() if len(found) > 1}
    assert doubles == {}
