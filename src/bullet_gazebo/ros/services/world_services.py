"""All services that read and change what is in the world already, one object for each group."""

from bullet_gazebo.ros.services.force_services import ForceServices
from bullet_gazebo.ros.services.joint_services import JointServices
from bullet_gazebo.ros.services.light_services import LightServices
from bullet_gazebo.ros.services.link_services import LinkServices
from bullet_gazebo.ros.services.model_services import ModelServices
from bullet_gazebo.ros.services.motion_services import MotionServices
from bullet_gazebo.ros.services.physics_services import PhysicsServices
from bullet_gazebo.ros.services.reconfigure import PhysicsReconfigure
from bullet_gazebo.ros.services.time_services import advertise_time_services
from bullet_gazebo.simulator import Simulator


def advertise_world_services(sim: Simulator) -> list[object]:
    """Offers them to ROS; returns what keeps them alive."""
    physics = PhysicsServices(sim)
    groups = (
        ModelServices,
        LinkServices,
        JointServices,
        MotionServices,
        ForceServices,
        LightServices,
    )
    return [
        *(group(sim) for group in groups),
        physics,
        PhysicsReconfigure(physics),
        *advertise_time_services(sim),  # the last, see there
    ]
