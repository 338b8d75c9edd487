"""spawn_urdf_model and delete_model (contract: gazebo_api.md sections 2.3 to 2.5)."""

import re

import rospkg
import rospy
from gazebo_msgs.srv import (
    DeleteModel,
    DeleteModelRequest,
    DeleteModelResponse,
    SpawnModel,
    SpawnModelRequest,
    SpawnModelResponse,
)

from bullet_gazebo.physics.description import DescriptionError, ModelDescription
from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import is_finite
from bullet_gazebo.physics.urdf import parse_urdf
from bullet_gazebo.physics.world import NameTaken
from bullet_gazebo.ros.conversions import from_pose_msg
from bullet_gazebo.ros.plugins import PluginRegistry
from bullet_gazebo.simulator import Simulator

ROOT_TAG = re.compile(r"<\s*([A-Za-z_][\w.:-]*)")
DECLARATION = re.compile(r"<\?.*?\?>", re.DOTALL)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
PACKAGE = re.compile(r"package://([^/\"'<>\s]+)")


class SpawnServices:
    """Services that bring models into the world and take them out."""

    def __init__(self, sim: Simulator, plugins: PluginRegistry) -> None:
        self._sim = sim
        self._plugins = plugins
        self._services = [
            rospy.Service("~spawn_urdf_model", SpawnModel, self._spawn_urdf),
            rospy.Service("~delete_model", DeleteModel, self._delete),
        ]

    def _spawn_urdf(self, request: SpawnModelRequest) -> SpawnModelResponse:
        text = COMMENT.sub("", DECLARATION.sub("", request.model_xml, count=1))
        root = ROOT_TAG.search(text)
        if root is None or root.group(1) != "robot":
            found = f"<{root.group(1)}>" if root else "no XML"
            raise _refused(f"entity format is invalid: {found} instead of a URDF's <robot>.")
        return self._spawn(request, _with_package_paths(text))

    def _spawn(self, request: SpawnModelRequest, text: str) -> SpawnModelResponse:
        try:
            description = parse_urdf(text, f"URDF of model '{request.model_name}'")
            model = self._add(request, description)
        except NameTaken:
            return SpawnModelResponse(False, "SpawnModel: Failure - entity already exists.")
        except (DescriptionError, LookupError) as error:
            rospy.logerr("SpawnModel: %s", error)
            return SpawnModelResponse(False, f"SpawnModel: {error}")
        for warning in description.warnings:
            rospy.logwarn("SpawnModel: %s: %s", request.model_name, warning)
        self._plugins.load(model, request.robot_namespace)
        return SpawnModelResponse(True, "SpawnModel: Successfully spawned entity")

    def _add(self, request: SpawnModelRequest, description: ModelDescription) -> Model:
        pose = from_pose_msg(request.initial_pose)
        if not request.model_name:
            raise DescriptionError("the model needs a name")
        if not is_finite(pose):
            raise DescriptionError(f"the initial pose of '{request.model_name}' is not finite")
        with self._sim.lock:
            frame = self._sim.world.frame(request.reference_frame)
            if frame is None:
                raise LookupError(
                    "reference reference_frame not found, "
                    "did you forget to scope the link by model name?"
                )
            return self._sim.world.spawn(request.model_name, description, frame[0].compose(pose))

    def _delete(self, request: DeleteModelRequest) -> DeleteModelResponse:
        with self._sim.lock:
            model = self._sim.world.model(request.model_name)
        if model is None:
            return DeleteModelResponse(False, "DeleteModel: model does not exist")
        self._plugins.unload(model)
        with self._sim.lock:
            if self._sim.world.models.get(model.name) is model:
                self._sim.world.delete(model.name)
        return DeleteModelResponse(True, "DeleteModel: successfully deleted model")


def _with_package_paths(text: str) -> str:
    """Replaces package://NAME by the package's folder."""
    packages = rospkg.RosPack()

    def path(match: re.Match[str]) -> str:
        try:
            return str(packages.get_path(match.group(1)))
        except rospkg.ResourceNotFound as error:
            name = match.group(1)
            raise _refused(f"urdf reference package name does not exist: {name}") from error

    return PACKAGE.sub(path, text)


def _refused(reason: str) -> rospy.ServiceException:
    """Gazebo fails the call as such here, instead of answering success=false."""
    rospy.logerr("SpawnModel: Failure - %s", reason)
    return rospy.ServiceException(f"SpawnModel: Failure - {reason}")
