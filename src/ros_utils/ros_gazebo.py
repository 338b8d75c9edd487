"""Starts, ends and controls a Gazebo-like simulator through the services of its node ``/gazebo``.

Every function that calls a service takes two keywords: `timeout`, the limit for the service to come up
and again for its answer [s], and `gazebo_ns`, the simulator's node, the prefix of its services' names.
Failures are logged, never raised. Positions are in [m], orientations are quaternions; all zeros mean no
rotation.
"""

from ros_utils._internal.gazebo.calls import GAZEBO, TIMEOUT
from ros_utils._internal.gazebo.launch import close_Gazebo, launch_Gazebo
from ros_utils._internal.gazebo.physics import (
    gazebo_get_gravity,
    gazebo_get_max_update_rate,
    gazebo_get_ODE_physics,
    gazebo_get_physics_properties,
    gazebo_get_time_step,
    gazebo_pause_physics,
    gazebo_reset_sim,
    gazebo_reset_world,
    gazebo_set_default_properties,
    gazebo_set_gravity,
    gazebo_set_max_update_rate,
    gazebo_set_ODE_physics,
    gazebo_set_physics_properties,
    gazebo_set_time_step,
    gazebo_step_physics,
    gazebo_unpause_physics,
)
from ros_utils._internal.gazebo.spawn import (
    gazebo_delete_model,
    gazebo_spawn_sdf_param,
    gazebo_spawn_sdf_path,
    gazebo_spawn_sdf_pkg,
    gazebo_spawn_sdf_string,
    gazebo_spawn_urdf_param,
    gazebo_spawn_urdf_path,
    gazebo_spawn_urdf_pkg,
    gazebo_spawn_urdf_string,
)
from ros_utils._internal.gazebo.state import (
    gazebo_apply_joint_effort,
    gazebo_get_joint_properties,
    gazebo_get_link_state,
    gazebo_get_model_names,
    gazebo_get_model_state,
    gazebo_get_world_properties,
    gazebo_set_link_state,
    gazebo_set_model_configuration,
    gazebo_set_model_state,
)

__all__ = [
    "GAZEBO",
    "TIMEOUT",
    "close_Gazebo",
    "gazebo_apply_joint_effort",
    "gazebo_delete_model",
    "gazebo_get_ODE_physics",
    "gazebo_get_gravity",
    "gazebo_get_joint_properties",
    "gazebo_get_link_state",
    "gazebo_get_max_update_rate",
    "gazebo_get_model_names",
    "gazebo_get_model_state",
    "gazebo_get_physics_properties",
    "gazebo_get_time_step",
    "gazebo_get_world_properties",
    "gazebo_pause_physics",
    "gazebo_reset_sim",
    "gazebo_reset_world",
    "gazebo_set_ODE_physics",
    "gazebo_set_default_properties",
    "gazebo_set_gravity",
    "gazebo_set_link_state",
    "gazebo_set_max_update_rate",
    "gazebo_set_model_configuration",
    "gazebo_set_model_state",
    "gazebo_set_physics_properties",
    "gazebo_set_time_step",
    "gazebo_spawn_sdf_param",
    "gazebo_spawn_sdf_path",
    "gazebo_spawn_sdf_pkg",
    "gazebo_spawn_sdf_string",
    "gazebo_spawn_urdf_param",
    "gazebo_spawn_urdf_path",
    "gazebo_spawn_urdf_pkg",
    "gazebo_spawn_urdf_string",
    "gazebo_step_physics",
    "gazebo_unpause_physics",
    "launch_Gazebo",
]
