"""What ros_utils answers to a failure is false, whatever its shape: users write ``if f(...):``."""

import inspect
import math
import re

import pytest
from geometry_msgs.msg import Pose

from ros_utils import ros_controllers, ros_gazebo, ros_launch, ros_node, ros_params, ros_spawn, ros_urdf

MODULES = (ros_controllers, ros_gazebo, ros_launch, ros_node, ros_params, ros_spawn, ros_urdf)
FUNCTIONS = {
    name: function
    for module in MODULES
    for name, function in inspect.getmembers(module, inspect.isfunction)
    if name.startswith(("ros_", "urdf_", "gazebo_", "launch_", "close_", "init_", "spawn_"))
    or name.endswith("_srv")
}
# Nothing to end is no failure; a physical quantity that isn't known is NaN, as its page says.
NO_FAILURE = {name for name in FUNCTIONS if name.startswith(("ros_kill_", "close_"))}
QUANTITIES = {
    "gazebo_get_gravity",
    "gazebo_get_max_update_rate",
    "gazebo_get_time_step",
    "gazebo_get_ODE_physics",
}
TUPLES = {
    "gazebo_get_joint_properties": ("position", "rate", "success"),
    "gazebo_get_link_state": ("pose", "twist", "success"),
    "gazebo_get_model_state": ("header", "pose", "twist", "success"),
    "gazebo_get_world_properties": ("success", "sim_time", "model_names"),
    "gazebo_spawn_urdf_param": ("success", "status_message"),
    "gazebo_spawn_urdf_path": ("success", "status_message"),
    "gazebo_spawn_urdf_pkg": ("success", "status_message"),
    "gazebo_spawn_urdf_string": ("success", "status_message"),
}
ARGUMENTS = {
    "pose": Pose(),
    "joint_names": ["j"],
    "joint_positions": [0.0],
    "controllers_file": None,
    **dict.fromkeys(["controller_list", "spawn_controllers", "kill_controllers", "reset_controllers"], ["c"]),
    **dict.fromkeys(["start_controllers", "stop_controllers"], ["c"]),
    **dict.fromkeys(["auto_disable_bodies", "sor_pgs_precon_iters", "sor_pgs_iters"], 0),
    **dict.fromkeys(["x", "y", "z", "max_update_rate", "new_time_step", "effort", "duration"], 1.0),
}


def call(name):
    """The answer of a function that is given what isn't there."""
    required = [
        parameter.name
        for parameter in inspect.signature(FUNCTIONS[name]).parameters.values()
        if parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD
    ]
    more = {"custom_world_path": "/nix.world"} if name == "launch_Gazebo" else {}
    return FUNCTIONS[name](*(ARGUMENTS.get(parameter, "nix") for parameter in required), **more)


def test_all_functions_of_the_contract_are_looked_at(root):
    page = (root / "docs/contract/ros_utils.md").read_text(encoding="utf-8")
    names = set(re.findall(r"^(\w+)\(", page.split("\n## 10 ")[1], re.MULTILINE))
    assert len(names) == 53
    assert names <= set(FUNCTIONS)


@pytest.mark.parametrize("name", sorted(set(FUNCTIONS) - NO_FAILURE - QUANTITIES))
def test_a_failure_is_false_and_still_the_tuple_of_the_contract(no_master, name):
    answer = call(name)
    assert not answer
    if name in TUPLES:
        assert isinstance(answer, tuple)
        assert answer._fields == TUPLES[name]
        assert answer.success is False
        assert answer._replace(success=True)


@pytest.mark.parametrize("name", sorted(QUANTITIES - {"gazebo_get_ODE_physics"}))
def test_an_unknown_quantity_is_no_number(no_master, name):
    answer = call(name)
    assert math.isnan(getattr(answer, "x", answer))
