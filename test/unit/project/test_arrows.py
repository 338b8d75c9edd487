"""The architecture (docs/architecture.md): who may import whom, no circles, one name for one thing."""

import ast
import subprocess
import sys
from collections import defaultdict
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from lockstep_runner.script import LIBRARIES
from rl_workbench.training.algorithms import ALGORITHMS

SRC = Path(__file__).resolve().parents[3] / "src"
ROOT = SRC.parent
MODULES = sorted(SRC.rglob("*.py"))
FOLDERS = sorted({path.parent for path in MODULES} | {SRC})
OURS = {"bullet_gazebo", "cartpole", "rl_workbench", "robot_envs", "ros_calls", "ros_utils",
        "file_access", "lockstep_runner", "package_writing", "web_viewer"}  # fmt: skip
LEARNING = {"gymnasium", "torch", "stable_baselines3", "matplotlib"}
MOST_ENTRIES = 25
MOST_DOUBLE_CLASSES = 3
ROS = ("rospy", "rosgraph", "rosnode", "roslib", "rosparam", "roslaunch", "rosservice")
ROS_ROOMS = (
    "bullet_gazebo/ros",
    "lockstep_runner",
    "ros_calls",
    "ros_utils",
    "robot_envs/backends",
    "robot_envs/deployment",
)

# A library, and which of ours it may import.
ALLOWED = {
    "bullet_gazebo": {"ros_calls", "file_access", "web_viewer"},
    "ros_calls": {"file_access"},
    "file_access": set(),
    "ros_utils": {"ros_calls", "file_access"},
    "robot_envs": {"bullet_gazebo", "file_access", "ros_calls", "ros_utils", "web_viewer"},
    "lockstep_runner": {"file_access", "ros_calls"},
    "package_writing": {"bullet_gazebo", "file_access", "robot_envs", "ros_calls"},
    "rl_workbench": {"file_access", "web_viewer"},
    "web_viewer": {"file_access"},
    "cartpole": {"rl_workbench", "robot_envs"},
}
# The modules or folders of the algorithms, below rl_workbench.training.
ADAPTERS = {".".join(kind.implementation.split(".")[:3]) for kind in ALGORITHMS.values()}
# A folder, and what nothing in it may import beside that.
FORBIDDEN = [
    ("bullet_gazebo/physics", ("bullet_gazebo.control", "bullet_gazebo.ros", "bullet_gazebo.simulator",
                               "bullet_gazebo.timing")),
    ("bullet_gazebo/control", ("bullet_gazebo.physics", "bullet_gazebo.ros", "bullet_gazebo.simulator",
                               "bullet_gazebo.timing", "pybullet")),
    ("bullet_gazebo", ("gymnasium", "torch")),
    ("ros_utils", ("pybullet", "torch")),
    ("robot_envs", ("torch",)),
    *((f"robot_envs/{each}", ("bullet_gazebo.ros",)) for each in (
        "backends/in_process.py", "backends/backend.py", "deployment", "pictures", "robots", "testing",
        "variation", "environment.py", "task.py", "robot.py",
    )),
    ("cartpole", ("pybullet", "torch")),
    ("rl_workbench/agents", ("gymnasium", "rl_workbench.tools", "rl_workbench.training")),
    ("rl_workbench/training", ("rl_workbench.tools",)),
    ("rl_workbench/training/training.py", tuple(ADAPTERS)),
    *((f"{own.replace('.', '/')}{suffix}", tuple(ADAPTERS - {own}))
      for own in ADAPTERS for suffix in ("", ".py")),
]  # fmt: skip
WITHOUT_ROS = (
    "bullet_gazebo.physics.world",
    "bullet_gazebo.control.manager",
    "bullet_gazebo.simulator",
    "cartpole.pg_train",
    "cartpole.workbench",
    "rl_workbench.cli",
    "rl_workbench.training.training",
    "robot_envs.backends.in_process",
    "robot_envs.environment",
)


@cache
def imports(path: Path) -> list[str]:
    names = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute"
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return names


def below(name: str, package: str) -> bool:
    return name == package or name.startswith(f"{package}.")


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(SRC)))
def test_nothing_imports_against_the_arrows(path: Path) -> None:
    library = path.relative_to(SRC).parts[0]
    forbidden = OURS - {library} - ALLOWED[library]
    for room, packages in FORBIDDEN:
        if path.is_relative_to(SRC / room):
            forbidden |= set(packages)
    if not any(path.is_relative_to(SRC / room) for room in ROS_ROOMS):
        forbidden |= set(ROS)
    against = {name for name in imports(path) for package in forbidden if below(name, package)}
    assert not against


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: str(path.relative_to(SRC)))
def test_what_lies_in_a_folder_imports_in_no_circle(folder: Path) -> None:
    """Modules and folders in it, each folder as one."""
    own = folder.relative_to(SRC).parts
    children: dict[str, set[str]] = defaultdict(set)
    for path in (path for path in MODULES if path.is_relative_to(folder)):
        child = path.relative_to(folder).parts[0].removesuffix(".py")
        for name in imports(path):
            parts = tuple(name.split("."))
            if parts[: len(own)] == own and len(parts) > len(own):
                other = parts[len(own)]
                exists = (folder / other).is_dir() or (folder / f"{other}.py").is_file()
                if exists and other != child:
                    children[child].add(other)
    try:
        TopologicalSorter(children).prepare()
    except CycleError as error:
        pytest.fail(f"{folder.relative_to(SRC)}: {' -> '.join(error.args[1])}")


def test_a_wait_in_our_libraries_stays_wall_time_under_the_lockstep_runner() -> None:
    assert {path.name for path in SRC.iterdir() if (path / "__init__.py").exists()} == OURS
    assert OURS <= LIBRARIES


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
    done = subprocess.run(
        [sys.executable, "-c", script], env={"PYTHONPATH": str(SRC), "PATH": "/usr/bin:/bin"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def loaded_by(*names: str) -> set[str]:
    """The top-level packages that a fresh Python has after importing modules."""
    done = subprocess.run(
        [sys.executable, "-c", f"import sys, {', '.join(names)}; print(*sys.modules)"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return {name.partition(".")[0] for name in done.stdout.split()}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "absent"),
    [
        ("bullet_gazebo.ros.node.gzserver", LEARNING),
        ("bullet_gazebo.ros.clients.gz", {"rospy", *LEARNING}),
        ("bullet_gazebo.simulator", LEARNING),
    ],
)
def test_an_import_leaves_out_what_takes_seconds(module: str, absent: set[str]) -> None:
    assert not loaded_by(module) & absent


def test_no_folder_is_crowded() -> None:
    entries: dict[Path, set[str]] = defaultdict(set)
    for path in (each for each in MODULES if each.name[:2] != "__"):
        for folder in path.relative_to(SRC).parents:  # a folder that git has left behind is none
            entries[folder].add(path.relative_to(SRC / folder).parts[0])
    assert {
        str(each): len(names) for each, names in entries.items() if len(names) > MOST_ENTRIES
    } == {}


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
