"""Models with random changes, made with knowledge of the grammar; and what reading one may do.

For `test_mutations.py`: each of CASES has a strategy of texts and a reader, which returns "read" or the one
line of the refusal, and raises AssertionError for anything else. `spawn` takes the texts of "entity" further,
into an engine.
"""

import copy
import math
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from hypothesis import strategies as st
from support.mutations.xml_trees import MOST_CHANGES, mutated_xml
from support.robots.cartpole import cartpole_urdf

from file_access.content import FileError
from file_access.expansion import CannotExpand, expand
from file_access.yaml_text import load_parameters
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import GAINS, RobotHardware
from robot_sim.control.manager import ControllerManager
from robot_sim.control.transmissions import read_description
from robot_sim.physics.description import DescriptionError, ModelDescription
from robot_sim.physics.files.reading import Reading, Resources
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.files.world_file import parse_world, read_entity
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World

DATA = Path(__file__).resolve().parents[2] / "data"
LONGEST = 5000  # characters of a refusal

BASES = DATA / "mutations"
URDF, SDF, WORLD, XACRO = (
    (BASES / name).read_text(encoding="utf-8")
    for name in ("robot.urdf", "model.sdf", "my.world", "robot.xacro")
)


class Case(NamedTuple):
    texts: st.SearchStrategy[Any]
    read: Callable[[Any], str]


def outcome(read: Callable[[Any], object], fault: type[ValueError], given: Any) -> str:
    """Returns "read", or the text of the refusal, which is one line of a length that suits a log."""
    try:
        found = read(given)
    except fault as error:
        text = str(error)
        assert text, "a refusal without a reason"
        assert "\n" not in text, text
        assert len(text) <= LONGEST, f"{len(text)} characters: {text[:200]}"
        return text
    for warning in getattr(found, "warnings", ()):
        assert "\n" not in warning, warning
        assert len(warning) <= LONGEST + 100, f"{len(warning)} characters: {warning[:200]}"
    return "read"


def _resources() -> Resources:
    return Resources(models=(DATA / "models",), media=(DATA,))


def _read_entity(text: str) -> object:
    return read_entity(text, "m", _resources(), Reading())


def _expand(text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "r.xacro")
        path.write_text(text, encoding="utf-8")
        outcome(parse_urdf, DescriptionError, expand(path))


def _control(text: str) -> None:
    RobotHardware(read_description(text))


CONTROLLERS: dict[str, Any] = {
    name: params
    for file in ("slides.yaml", "slides_trajectories.yaml")
    for name, params in yaml.safe_load((DATA / "robots" / file).read_text()).items()
    if not str(params.get("type")).startswith("my_")
} | {
    "joint_limits": {
        "effort_a": {"has_position_limits": True, "min_position": -1, "max_position": 1,
                     "has_velocity_limits": True, "max_velocity": 1.0, "has_effort_limits": False}
    }
}  # fmt: skip
ODD_VALUES = st.sampled_from([
    None, True, False, 0, -1, 1, 2**40, 10**30, 0.5, math.nan, math.inf, -math.inf, 1e308, 5e-324,
    "", "x", "nan", "1", "effort_a", "position_a", "states", "x" * 3000, "a\nb", b"\0",
    [], [[]], ["effort_a"], ["effort_a"] * 50, [1], [None], {}, {"p": 1.0}, {"p": math.nan},
    {"x": {"y": {}}}, "effort_controllers/JointTrajectoryController",
    "joint_state_controller/JointStateController", "velocity_controllers/JointGroupVelocityController",
])  # fmt: skip
TREE_CHANGES = st.tuples(
    st.sampled_from(["value", "drop", "copy", "add"]),
    st.integers(0, 10**6),
    st.integers(0, 10**6),
    ODD_VALUES,
)


def _changed_tree(changes: list[tuple[str, int, int, Any]]) -> dict[str, Any]:
    tree = copy.deepcopy(CONTROLLERS)
    for kind, first, second, value in changes:
        places = _places(tree)
        holder, key = places[first % len(places)]
        other, name = places[second % len(places)]
        if kind == "value":
            holder[key] = copy.deepcopy(value)
        elif kind == "drop":
            del holder[key]
        elif kind == "copy":
            other[name] = copy.deepcopy(holder[key])
        elif isinstance(holder, dict):
            holder[str(name)] = copy.deepcopy(value)
    return tree


def _places(tree: Any) -> list[tuple[Any, Any]]:
    keys = list(tree) if isinstance(tree, dict) else list(range(len(tree)))
    found = [(tree, key) for key in keys]
    for key in keys:
        if isinstance(tree[key], (dict, list)) and tree[key]:
            found += _places(tree[key])
    return found


@cache
def _slides() -> str:
    return expand(DATA / "robots" / "slides.urdf")


def _load(tree: dict[str, Any]) -> str:
    """Loads all controllers of a tree of parameters; each is there then, or refused with its reason."""
    try:
        description = read_description(_slides()).limited_by(tree.get("joint_limits"))
        gains = tree.get("gazebo_ros_control")
        gains = gains.get(GAINS.rpartition("/")[2]) if isinstance(gains, dict) else None
        manager = ControllerManager(RobotHardware(description, gains if isinstance(gains, dict) else {}))
    except ControlError as error:
        assert "\n" not in str(error)
        return str(error)
    refused = []
    for name, params in tree.items():
        if name in ("joint_limits", "gazebo_ros_control"):
            continue
        try:
            manager.load(name, params)
        except ControlError as error:
            assert error.__cause__ is None or isinstance(error.__cause__, ControlError), repr(error)
            assert "\n" not in str(error)
            refused.append(str(error))
    return "; ".join(refused) or "read"


def _load_text(tree: dict[str, Any]) -> str:
    """As files have it: written, and read again."""
    text = yaml.safe_dump(tree)
    return outcome(load_parameters, FileError, text)


TREES = st.lists(TREE_CHANGES, min_size=1, max_size=MOST_CHANGES).map(_changed_tree)
ROBOTS = mutated_xml(URDF) | mutated_xml(cartpole_urdf())

READ_SDF = partial(parse_sdf, resources=_resources())
READ_WORLD = partial(parse_world, resources=_resources())

CASES: dict[str, Case] = {
    "urdf": Case(ROBOTS, partial(outcome, parse_urdf, DescriptionError)),
    "sdf": Case(mutated_xml(SDF), partial(outcome, READ_SDF, DescriptionError)),
    "entity": Case(mutated_xml(SDF) | ROBOTS, partial(outcome, _read_entity, DescriptionError)),
    "world": Case(mutated_xml(WORLD), partial(outcome, READ_WORLD, DescriptionError)),
    "robot_description": Case(ROBOTS, partial(outcome, _control, ControlError)),
    "controllers": Case(TREES, _load),
    "yaml": Case(TREES, _load_text),
    "xacro": Case(mutated_xml(XACRO), partial(outcome, _expand, CannotExpand)),  # 0.2 s each
}


def spawn(world: World, text: str) -> str:
    """As a case's reader, and what was read stands in a world for some steps, and goes again."""
    try:
        entity = _read_entity(text)
        if not isinstance(entity, ModelDescription):
            return "read"
        model = world.spawn("m", entity, Pose())
    except DescriptionError as error:
        return str(error)
    for _ in range(3):
        world.step()
    states: list[Any] = [*model.joint_states()]
    states += [world.frame(f"m::{link}")[0].position for link in model.link_names]
    world.delete("m")
    assert all(math.isfinite(number) for state in states for number in state), states
    return "read"
