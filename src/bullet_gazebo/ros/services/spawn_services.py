"""spawn_urdf_model, spawn_sdf_model and delete_model (docs/contract/gazebo.md 2.3 to 2.5)."""

import re
import threading

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

from bullet_gazebo.physics.description import DescriptionError, Light, ModelDescription
from bullet_gazebo.physics.files.elements import shown
from bullet_gazebo.physics.files.reading import Reading
from bullet_gazebo.physics.files.world_file import UnknownFormat, read_entity
from bullet_gazebo.physics.pose import Pose, is_finite
from bullet_gazebo.physics.world import NameTaken
from bullet_gazebo.ros.plugins import PluginRegistry
from bullet_gazebo.ros.services.resource_paths import resources
from bullet_gazebo.ros.wire.conversions import from_pose_msg
from bullet_gazebo.simulator import Simulator
from files.content import MAX_BYTES

ROOT_TAG = re.compile(r"<\s*([A-Za-z_][\w.:-]*)")
PACKAGE = re.compile(r"package://([^/\"'<>\s]+)")
UNKNOWN_FORMAT = (
    "GazeboRosApiPlugin SpawnModel Failure: input model_xml not SDF or URDF, "
    "or cannot be converted to Gazebo compatible format."
)
TAKEN = "SpawnModel: Failure - entity already exists."
MOST_WARNINGS = 20  # of one model
FURTHEST = 1e6  # [m] from the origin; the engine holds some figures as 32-bit floats


class SpawnServices:
    """Services that bring models and lights into the world, and take models out."""

    def __init__(self, sim: Simulator, plugins: PluginRegistry) -> None:
        self._sim = sim
        self._plugins = plugins
        # Spawning and deleting take several steps each, with plugins between them: one at a time, as
        # Gazebo serialises all its services (docs/contract/gazebo.md 1.1).
        self._one_at_a_time = threading.Lock()
        self._services = [
            rospy.Service("~spawn_urdf_model", SpawnModel, self._spawn_urdf),
            rospy.Service("~spawn_sdf_model", SpawnModel, self._spawn_sdf),
            rospy.Service("~delete_model", DeleteModel, self._delete),
        ]

    def _spawn_urdf(self, request: SpawnModelRequest) -> SpawnModelResponse:
        if len(request.model_xml) > MAX_BYTES:
            return self._spawn(
                request, request.model_xml
            )  # which refuses it, before anything looks at it
        text = without_comments(request.model_xml)
        root = ROOT_TAG.search(text)
        if root is None or root.group(1) != "robot":
            found = f"<{shown(root.group(1))}>" if root else "no XML"
            raise _refused(f"entity format is invalid: {found} instead of a URDF's <robot>.")
        return self._spawn(request, _with_package_paths(text))

    def _spawn_sdf(self, request: SpawnModelRequest) -> SpawnModelResponse:
        return self._spawn(request, request.model_xml)

    def _spawn(self, request: SpawnModelRequest, text: str) -> SpawnModelResponse:
        try:
            self._checked_pose(request)  # before anything takes time
            # A file may take long: spawns of others go on meanwhile.
            reading = Reading(cancelled=rospy.is_shutdown)
            entity = read_entity(text, request.model_name, resources(), reading)
            with self._one_at_a_time:
                pose = self._checked_pose(request)
                self._add(request, entity, pose.compose(entity_pose(entity)))
        except NameTaken:
            return SpawnModelResponse(False, TAKEN)
        except UnknownFormat as error:
            rospy.logerr("SpawnModel: %s", error)
            return SpawnModelResponse(False, f"{UNKNOWN_FORMAT} ({error})")
        except (DescriptionError, LookupError) as error:
            rospy.logerr("SpawnModel: %s", error)
            return SpawnModelResponse(False, f"SpawnModel: {error}")
        return SpawnModelResponse(True, "SpawnModel: Successfully spawned entity")

    def _checked_pose(self, request: SpawnModelRequest) -> Pose:
        """The requested pose in the world."""
        pose, name = from_pose_msg(request.initial_pose), request.model_name
        if not name:
            raise DescriptionError("the model needs a name")
        with self._sim.lock:
            frame = self._sim.world.frame(request.reference_frame)
            if frame is None:
                raise LookupError(
                    "reference reference_frame not found, "
                    "did you forget to scope the link by model name?"
                )
        pose = frame[0].compose(pose)
        if not is_finite(pose) or max(map(abs, pose.position)) > FURTHEST:
            raise DescriptionError(
                f"the initial pose of '{shown(name)}' is not finite, or beyond {FURTHEST:g} m"
            )
        return pose

    def _add(
        self, request: SpawnModelRequest, entity: ModelDescription | Light, pose: Pose
    ) -> None:
        name, world = request.model_name, self._sim.world
        if isinstance(entity, Light):
            with self._sim.lock:
                if name in world.lights:
                    raise NameTaken(name)
                entity.name, entity.pose = name, pose
                world.lights[name] = entity
                world.version += 1
            return
        with self._plugins.time_held(f"model '{shown(name)}'"):
            with self._sim.lock:
                model = world.spawn(name, entity, pose)
            self._plugins.load(model, request.robot_namespace)
        warn(model.name, entity)

    def _delete(self, request: DeleteModelRequest) -> DeleteModelResponse:
        with self._one_at_a_time:
            with self._sim.lock:
                model = self._sim.world.model(request.model_name)
            if model is None:
                return DeleteModelResponse(False, "DeleteModel: model does not exist")
            self._plugins.unload(model)
            with self._sim.lock:
                self._sim.delete_model(model)
        return DeleteModelResponse(True, "DeleteModel: successfully deleted model")


def entity_pose(entity: ModelDescription | Light) -> Pose:
    """Returns where the file puts it."""
    return entity.pose if isinstance(entity, Light) else entity.initial_pose


def warn(name: str, description: ModelDescription) -> None:
    """Logs what a model's file asked for in vain."""
    for warning in at_most(description.warnings):
        rospy.logwarn("Model '%s': %s", shown(name), warning)
    if description.left_out:
        rospy.logwarn(
            "Model '%s': not simulated here, so left out: %s",
            shown(name), ", ".join(at_most(description.left_out)),
        )  # fmt: skip


def at_most(texts: list[str]) -> list[str]:
    """Returns the first of `texts`: a file may hold any number of the same fault."""
    rest = len(texts) - MOST_WARNINGS
    return texts if rest <= 0 else [*texts[:MOST_WARNINGS], f"and {rest} more of the kind"]


def without_comments(text: str) -> str:
    """Returns `text` without its first XML declaration and without comments; an open one stays."""
    start = text.find("<?")
    end = text.find("?>", start) if start >= 0 else -1
    if end >= 0:
        text = text[:start] + text[end + 2 :]
    pieces, position = [], 0
    while (start := text.find("<!--", position)) >= 0:
        end = text.find("-->", start + 4)
        if end < 0:
            break
        pieces.append(text[position:start])
        position = end + 3
    return "".join([*pieces, text[position:]])


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
