"""Clients of the simulator's services, under the name that scripts import."""

from bullet_gazebo.ros.clients.spawn_model import (
    set_model_configuration_client,
    spawn_sdf_model_client,
    spawn_urdf_model_client,
)

__all__ = ["set_model_configuration_client", "spawn_sdf_model_client", "spawn_urdf_model_client"]
