"""Where a robot that isn't fixed to the world is, by one of Gazebo's own services."""

from gazebo_msgs.srv import GetLinkState

from bullet_gazebo.physics.pose import Pose
from robot_envs.backends.ros.service import ServiceClient
from robot_envs.errors import SimulatorError
from robot_envs.robot import Robot

SERVICE = "/gazebo/get_link_state"


def base_pose(robot: Robot) -> Pose:
    """The frame of the robot's root link, in the world.

    Raises:
        SimulatorError: if the simulator doesn't answer, or has no such robot.
    """
    link = f"{robot.model}::{robot.links.root}"
    answer = ServiceClient(SERVICE, GetLinkState)(link, "world")
    if not answer.success:
        raise SimulatorError(f"{SERVICE}: {answer.status_message}")
    place, turn = answer.link_state.pose.position, answer.link_state.pose.orientation
    return Pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
