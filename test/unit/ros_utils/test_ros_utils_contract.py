"""The complete list of ros_utils' functions: names, orders and defaults of the arguments.

Additions are keyword-only, so that calls written for the list keep their meaning
(docs/contract/ros_utils.md 10).
"""

import inspect
import re
import socket

import pytest

from ros_calls import master
from ros_utils import (
    ros_controllers,
    ros_gazebo,
    ros_launch,
    ros_node,
    ros_params,
    ros_spawn,
    ros_urdf,
    simulation,
)
from ros_utils._internal.gazebo import calls as _gazebo_calls

POSE = "pos_x=0.0, pos_y=0.0, pos_z=0.0, ori_x=0.0, ori_y=0.0, ori_z=0.0, ori_w=1.0"
TARGET = f"model_name='robot1', robot_namespace='/', reference_frame='world', {POSE}"
SWITCH = "ns=None, strictness=1, start_asap=False, timeout=3.0"
ODE = (
    "auto_disable_bodies, sor_pgs_precon_iters, sor_pgs_iters, sor_pgs_w, sor_pgs_rms_error_tol, "
    "contact_surface_layer, contact_max_correcting_vel, cfm, erp, max_contacts"
)
CONTRACT = {
    ros_launch: [
        "ros_launch_from_pkg(pkg_name, launch_file, args=None, launch_new_term=True)",
        "ros_launch_from_path(launch_file_path, args=None, launch_new_term=True)",
        "ros_kill_launch_process()",
    ],
    ros_node: [
        "ros_node_from_pkg(pkg_name, node_name, launch_master=False, launch_master_term=True, "
        "launch_new_term=True, name=None, ns='/', output='log', args=None)",
        "ros_kill_node(node_name)",
        "ros_kill_all_nodes()",
        "ros_kill_master()",
        "ros_kill_all_processes()",
    ],
    ros_params: [
        "ros_load_yaml_from_pkg(pkg_name, file_name, ns='/')",
        "ros_load_yaml_from_path(file_path, ns='/')",
    ],
    ros_urdf: [
        "urdf_load_from_pkg(pkg_name, model_name, param_name, folder='/urdf', ns=None, "
        "args_xacro=None)",
        "urdf_load_from_path(model_path, param_name, ns=None, args_xacro=None)",
        "urdf_parse_from_pkg(pkg_name, model_name, folder='/urdf', args_xacro=None)",
        "urdf_parse_from_path(model_path, args_xacro=None)",
    ],
    ros_controllers: [
        "load_controller_srv(controller_name, ns=None, max_retries=5)",
        "load_controller_list_srv(controller_list, ns=None, max_retries=5)",
        "unload_controller_srv(controller_name, ns=None, max_retries=5)",
        "unload_controller_list_srv(controller_list, ns=None, max_retries=5)",
        f"switch_controllers_srv(start_controllers, stop_controllers, {SWITCH}, max_retries=5)",
        f"start_controllers_srv(start_controllers, {SWITCH})",
        f"stop_controllers_srv(stop_controllers, {SWITCH})",
        f"reset_controllers_srv(reset_controllers, max_retries=10, {SWITCH})",
        f"spawn_controllers_srv(spawn_controllers, {SWITCH})",
        f"kill_controllers_srv(kill_controllers, {SWITCH})",
    ],
    ros_gazebo: [
        "launch_Gazebo(paused=False, use_sim_time=True, gui=True, recording=False, debug=False, "
        "verbose=False, output='screen', custom_world_path=None, custom_world_pkg=None, "
        "custom_world_name=None, respawn_gazebo=False, pub_clock_frequency=100, "
        "server_required=False, gui_required=False, launch_new_term=True)",
        "close_Gazebo()",
        "gazebo_set_max_update_rate(max_update_rate)",
        "gazebo_get_max_update_rate()",
        "gazebo_set_time_step(new_time_step)",
        "gazebo_get_time_step()",
        "gazebo_set_gravity(x, y, z)",
        "gazebo_get_gravity()",
        f"gazebo_set_ODE_physics({ODE})",
        "gazebo_get_ODE_physics()",
        "gazebo_set_default_properties()",
        "gazebo_reset_sim(retries=5)",
        "gazebo_reset_world(retries=5)",
        "gazebo_pause_physics(retries=5)",
        "gazebo_unpause_physics(retries=5)",
        "gazebo_step_physics(steps=1)",
        "gazebo_delete_model(model_name)",
        f"gazebo_spawn_urdf_path(model_path, {TARGET})",
        f"gazebo_spawn_urdf_pkg(pkg_name, file_name, file_folder='/urdf', {TARGET})",
        f"gazebo_spawn_urdf_string(model_string, {TARGET})",
        f"gazebo_spawn_urdf_param(param_name, {TARGET})",
        f"gazebo_spawn_sdf_path(model_path, {TARGET})",
        f"gazebo_spawn_sdf_pkg(pkg_name, file_name, file_folder='/sdf', {TARGET})",
        f"gazebo_spawn_sdf_string(model_string, {TARGET})",
        f"gazebo_spawn_sdf_param(param_name, {TARGET})",
        "gazebo_get_model_state(model_name, relative_entity_name='world')",
        "gazebo_set_model_state(model_name, ref_frame='world', pos_x=0.0, pos_y=0.0, pos_z=0.0, "
        "ori_x=0.0, ori_y=0.0, ori_z=0.0, ori_w=0.0, lin_vel_x=0.0, lin_vel_y=0.0, lin_vel_z=0.0, "
        "ang_vel_x=0.0, ang_vel_y=0.0, ang_vel_z=0.0, sleep_time=0.05)",
    ],
    ros_spawn: [
        "init_robot_state_pub(namespace='/', max_pub_freq=None, launch_new_term=False)",
        # The list's default for controllers_list is a list, which callers could change.
        "spawn_model_in_gazebo(pkg_name, model_urdf_file, controllers_file, controllers_list=(), "
        "model_urdf_folder='/urdf', ns='/', args_xacro=None, max_pub_freq=None, rob_st_term=False, "
        "gazebo_name='robot1', gaz_ref_frame='world', pos_x=0.0, pos_y=0.0, pos_z=0.0, ori_w=0.0, "
        "ori_x=0.0, ori_y=0.0, ori_z=0.0)",
    ],
}
SIGNATURES = [(module, each) for module, signatures in CONTRACT.items() for each in signatures]


def test_the_list_is_complete():
    assert len(SIGNATURES) == 53


def test_the_list_is_the_contracts(root):
    page = (root / "docs/contract/ros_utils.md").read_text(encoding="utf-8")
    blocks = re.findall(r"`(\w+)`:\n\n```\n(.*?)```", page.split("\n## 10 ")[1], re.DOTALL)
    listed = {module: text.splitlines() for module, text in blocks}
    # A list as a default could be changed by a caller; an empty tuple means the same.
    ours = {
        module.__name__.rpartition(".")[2]: [
            each.replace("controllers_list=()", "controllers_list=[]") for each in signatures
        ]
        for module, signatures in CONTRACT.items()
    }
    assert listed == ours


@pytest.mark.parametrize(("module", "signature"), SIGNATURES, ids=[s for _, s in SIGNATURES])
def test_signature(module, signature):
    name = signature.split("(")[0]
    parameters = inspect.signature(getattr(module, name)).parameters.values()
    positional = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for parameter in parameters
        if parameter.kind is not inspect.Parameter.KEYWORD_ONLY
    ]
    assert f"{name}{inspect.Signature(positional)}" == signature


@pytest.mark.parametrize(
    "function", [getattr(ros_gazebo, name) for name in ros_gazebo.__all__ if name[0] == "g"]
)
def test_every_call_has_a_bound_and_a_simulator(function):
    parameters = inspect.signature(function).parameters
    assert parameters["timeout"].kind is inspect.Parameter.KEYWORD_ONLY
    assert parameters["gazebo_ns"].default == "/gazebo"


def test_a_zero_quaternion_is_no_rotation():
    turn = _gazebo_calls.make_pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0).orientation
    assert (turn.x, turn.y, turn.z, turn.w) == (0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_what_is_not_finite_is_not_sent(number):
    with pytest.raises(_gazebo_calls.BadNumber, match="speed"):
        _gazebo_calls.check_finite("speed", 1.0, number)


def test_reserved_ports_differ_and_can_be_taken_by_a_master():
    ports = {simulation.reserved_port() for _ in range(20)}
    assert len(ports) == 20
    for port in ports:
        with socket.socket() as server:
            server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as a ROS master does
            server.bind(("127.0.0.1", port))


def test_another_master_is_for_the_block_only(monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://here:1")
    with master.using("http://there:2"):
        assert master.uri() == "http://there:2"
    assert master.uri() == "http://here:1"
