"""What Gazebo's own services do for robots in real time: time goes on or stops, all is put in place."""

from collections.abc import Mapping, Sequence
from typing import Any

from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import GetLinkState, SetModelConfiguration, SetModelState
from geometry_msgs.msg import Point, Quaternion, Twist, Vector3
from geometry_msgs.msg import Pose as PoseMsg
from std_srvs.srv import Empty

from bullet_gazebo.physics.pose import Pose
from robot_envs.backends.ros.bringup.robots import full_name
from robot_envs.backends.ros.service import ServiceClient
from robot_envs.backends.ros.wire.messages import pose_of
from robot_envs.errors import SimulatorError
from robot_envs.scene import Scene
from robot_envs.world_state import Motion


class GazeboServices:
    """Those that an environment in real time calls; all raise a SimulatorError where they fail.

    Args:
        scene: the robots.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.pause = ServiceClient("/gazebo/pause_physics", Empty)
        self.unpause = ServiceClient("/gazebo/unpause_physics", Empty)
        self._reset_world = ServiceClient("/gazebo/reset_world", Empty)
        self._set_joints = ServiceClient("/gazebo/set_model_configuration", SetModelConfiguration)
        self._set_model = ServiceClient("/gazebo/set_model_state", SetModelState)
        self._get_link = ServiceClient("/gazebo/get_link_state", GetLinkState)

    def reset(self, positions: Mapping[str, float], models: Mapping[str, Motion]) -> None:
        """Resets the world, then puts joints and models where they are to be, the joints at rest.

        Args:
            positions: of all joints [rad, m], by their keys in the scene.
            models: where they are and how they move.
        """
        self._reset_world()
        for name, (pose, (line, turn)) in models.items():
            at = PoseMsg(Point(*pose.position), Quaternion(*pose.orientation))
            wanted = ModelState(name, at, Twist(Vector3(*line), Vector3(*turn)), "world")
            _check(self._set_model(wanted), f"model '{name}' can't be placed")
        for robot in self._scene.robots:
            own = {
                name: positions[key] for key, (of, name) in self._scene.moved.items() if of is robot
            }
            answer = self._set_joints(
                robot.model, full_name(robot, robot.description), list(own), list(own.values())
            )
            _check(answer, f"the robot '{robot.model}' can't be reset")

    def poses(self, links: Sequence[str]) -> list[Pose]:
        """Where links are in the world; a call for each."""
        answers = [self._get_link(link, "world") for link in links]
        for link, answer in zip(links, answers, strict=True):
            _check(answer, f"where '{link}' is isn't told")
        return [pose_of(answer.link_state.pose) for answer in answers]


def _check(answer: Any, what: str) -> None:
    if not answer.success:
        raise SimulatorError(f"{what}: {answer.status_message}")
