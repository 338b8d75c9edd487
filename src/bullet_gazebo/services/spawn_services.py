"""Spawning: the world file, spawn_urdf_model, spawn_sdf_model, and delete_model.

See docs/contract/gazebo.md 2.3 to 2.5, and gazebo_launch.md 4.1 and 4.2 for the search paths.
"""

import contextlib
import functools
import os
import re
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import rospkg
import rospy
from gazebo_msgs import srv

from bullet_gazebo.common.messages import from_pose_msg
from bullet_gazebo.plugins.plugin_loader import PluginRegistry
from bullet_gazebo.services import NO_MODEL, existing, offer
from file_access.content import MAX_BYTES, FileError, read_file
from file_access.xml_text import decode, parse
from robot_sim.physics.description import DescriptionError, Light, ModelDescription, Plugin
from robot_sim.physics.files.elements import shown
from robot_sim.physics.files.reading import LoadProgress, Reading, Resources
from robot_sim.physics.files.world_file import (
    UnknownFormat,
    WorldDescription,
    empty_world,
    fill,
    load_world,
    read_entity,
)
from robot_sim.physics.pose import Pose, is_finite
from robot_sim.physics.world import NameTaken
from robot_sim.simulator import Simulator

ROOT_TAG = re.compile(r"<\s*([A-Za-z_][\w.:-]*)")
PACKAGE = re.compile(r"package://([^/\"'<>\s]+)")
UNKNOWN_FORMAT = (
    "GazeboRosApiPlugin SpawnModel Failure: input model_xml not SDF or URDF, "
    "or cannot be converted to Gazebo compatible format."
)
TAKEN = "SpawnModel: Failure - entity already exists."
MOST_WARNINGS = 20  # of one model
FURTHEST = 1e6  # [m] from the origin; the engine keeps some figures as 32-bit floats
RESOURCES = "GAZEBO_RESOURCE_PATH"
MODELS = "GAZEBO_MODEL_PATH"
EXPORT = "gazebo_model_path"
HOME_MODELS = "~/.gazebo/models"


class SpawnServices:
    """Services that bring models and lights into the world, and take models out."""

    def __init__(self, sim: Simulator, plugins: PluginRegistry, one_at_a_time: threading.Lock) -> None:
        """While someone else holds `one_at_a_time`, requests wait."""
        self._sim = sim
        self._plugins = plugins
        # Spawning and deleting take several steps, with plugins between them: one at a time, as Gazebo
        # serialises all its services (docs/contract/gazebo.md 1.1).
        self._one_at_a_time = one_at_a_time
        self._under_way: list[srv.SpawnModelRequest] = []
        self._spawned = 0
        self._services = [
            rospy.Service("~spawn_urdf_model", srv.SpawnModel, self._spawn_urdf),
            rospy.Service("~spawn_sdf_model", srv.SpawnModel, self._spawn_sdf),
            offer("~delete_model", srv.DeleteModel, self._delete),
        ]

    def count(self, *_: object) -> tuple[int, str, list[int]]:
        """Answers by XML-RPC how many models are being spawned, and how many have been."""
        return 1, "", [len(self._under_way), self._spawned]

    def _spawn_sdf(self, request: srv.SpawnModelRequest) -> srv.SpawnModelResponse:
        return self._spawn(request, request.model_xml)

    def _spawn_urdf(self, request: srv.SpawnModelRequest) -> srv.SpawnModelResponse:
        if len(request.model_xml) > MAX_BYTES:
            return self._spawn_sdf(request)  # refuses it before anything parses it
        text = without_comments(request.model_xml)
        root = ROOT_TAG.search(text)
        if root is None or root.group(1) != "robot":
            what = f"<{shown(root.group(1))}>" if root else "no XML"
            raise _refused(f"entity format is invalid: {what} instead of a URDF's <robot>.")
        return self._spawn(request, _with_package_paths(text))

    def _spawn(self, request: srv.SpawnModelRequest, text: str) -> srv.SpawnModelResponse:
        self._under_way.append(request)
        try:
            self._checked_pose(request)  # before anything takes time
            reading = Reading(cancelled=rospy.is_shutdown)  # reading may take long; others spawn meanwhile
            entity = read_entity(text, request.model_name, resources(), reading)
            own = entity.pose if isinstance(entity, Light) else entity.initial_pose
            with self._one_at_a_time:
                self._add(request, entity, self._checked_pose(request).compose(own))
                self._spawned += 1
        except NameTaken:
            return srv.SpawnModelResponse(False, TAKEN)
        except UnknownFormat as error:
            rospy.logerr("SpawnModel: %s", error)
            return srv.SpawnModelResponse(False, f"{UNKNOWN_FORMAT} ({error})")
        except (DescriptionError, LookupError) as error:
            rospy.logerr("SpawnModel: %s", error)
            return srv.SpawnModelResponse(False, f"SpawnModel: {error}")
        finally:
            self._under_way.pop()
        return srv.SpawnModelResponse(True, "SpawnModel: Successfully spawned entity")

    def _checked_pose(self, request: srv.SpawnModelRequest) -> Pose:
        """Returns the requested pose in the world."""
        pose, name = from_pose_msg(request.initial_pose), request.model_name
        if not name:
            raise DescriptionError("the model needs a name")
        with self._sim.lock.glance():
            frame = self._sim.world.frame(request.reference_frame)
            if frame is None:
                raise LookupError(
                    "reference reference_frame not found, did you forget to scope the link by model name?"
                )
        pose = frame[0].compose(pose)
        if not is_finite(pose) or max(map(abs, pose.position)) > FURTHEST:
            raise DescriptionError(
                f"the initial pose of '{shown(name)}' is not finite, or beyond {FURTHEST:g} m"
            )
        return pose

    def _add(self, request: srv.SpawnModelRequest, entity: ModelDescription | Light, pose: Pose) -> None:
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
        _log(f"Model '{shown(name)}'", entity)

    def _delete(self, request: srv.DeleteModelRequest) -> str:
        with self._one_at_a_time:
            with self._sim.lock.glance():
                model = existing(self._sim.world.model(request.model_name), NO_MODEL)
            with self._plugins.time_held(f"model '{shown(model.name)}'"):
                self._plugins.unload(model)
                with self._sim.lock:
                    self._sim.delete_model(model)
        return "DeleteModel: successfully deleted model"


def read_world(name: str, interrupted: Callable[[], bool]) -> WorldDescription:
    """Reads a world file. If it is unusable, logs why and returns a world with just a ground plane.

    Reading ends early once `interrupted` returns true.
    """
    path = find_world(name)
    if path is None:
        rospy.logwarn("World file '%s' is not found: the world is empty but for a ground plane", name)
        return empty_world()
    try:
        world = load_world(path, resources(), Reading(interrupted))
    except DescriptionError as error:
        rospy.logerr("%s. The world is empty but for a ground plane", error)
        return empty_world()
    _log(f"World '{path}'", world)
    return world


def fill_world(sim: Simulator, world: WorldDescription, interrupted: Callable[[], bool]) -> None:
    """Sets time, gravity and step, and adds lights and models; a model that the engine refuses is left out.

    No more models are added once `interrupted` returns true.
    """
    with sim.lock:
        sim.now = world.start
        sim.set_time_step(world.time_step)
        sim.max_update_rate = world.update_rate
        sim.world.set_gravity(world.gravity)
        sim.world.set_solver(world.solver)
        sim.world.lights.update(world.lights)
        progress = LoadProgress("models are loaded", len(world.models))
        for name, error in fill(sim.world, world.models):
            if error is not None:
                rospy.logwarn("Model '%s' is left out: %s", name, error)
            if interrupted():
                return
            progress.one_more()


def load_plugins(sim: Simulator, plugins: PluginRegistry, of_world: Sequence[Plugin] = ()) -> None:
    """Starts the plugins of the world file and of its models."""
    unknown = [each.name or each.filename for each in of_world if not plugins.load_of_world(each)]
    if unknown:
        text = ", ".join(_listed([f"plugin '{shown(name)}'" for name in unknown]))
        rospy.logwarn("The world: not simulated here, so left out: %s", text)
    with plugins.time_held("the world"):
        for model in list(sim.world.models.values()):
            plugins.load(model, "")
            _log(f"Model '{shown(model.name)}'", model.description)


def _log(what: str, found: WorldDescription | ModelDescription) -> None:
    """Logs a file's warnings, and what was left out of the world."""
    for warning in _listed(found.warnings):
        rospy.logwarn("%s: %s", what, warning)
    if isinstance(found, WorldDescription):
        return
    for name in found.stand_ins:
        _tell_stand_in(name)
    if found.left_out:
        text = ", ".join(_listed(found.left_out))
        rospy.logwarn("%s: not simulated here, so left out: %s", what, text)


@functools.cache
def _tell_stand_in(name: str) -> None:
    rospy.logwarn("model://%s is not installed: a simple shape of its size and mass stands in for it", name)


def _listed(texts: list[str]) -> list[str]:
    """Returns each text once, with how often it is there, and at most MOST_WARNINGS of them."""
    counts = Counter(texts)
    once = [text if count == 1 else f"{text} ({count} times)" for text, count in counts.items()]
    rest = len(once) - MOST_WARNINGS
    return once if rest <= 0 else [*once[:MOST_WARNINGS], f"and {rest} more of the kind"]


def without_comments(text: str) -> str:
    """Returns `text` without its first XML declaration and its comments; an open comment stays."""
    before, _, after = text.partition("<?")
    _, end, rest = after.partition("?>")
    if end:
        text = before + rest
    # Behind the last end no comment closes: looking for one there takes quadratic time.
    before, end, rest = text.rpartition("-->")
    return re.sub(r"<!--.*?-->", "", before + end, flags=re.DOTALL) + rest


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
    """Returns an exception: here Gazebo fails the call itself, instead of answering success=false."""
    rospy.logerr("SpawnModel: Failure - %s", reason)
    return rospy.ServiceException(f"SpawnModel: Failure - {reason}")


def resources() -> Resources:
    """Returns the look-up of this process's environment; packages are found as rospack finds them, once."""
    packages = rospkg.RosPack()

    def package(name: str) -> str:
        try:
            return str(packages.get_path(name))
        except rospkg.ResourceNotFound as error:
            raise LookupError(name) from error

    return Resources(_model_folders(), tuple(_environment_paths()), package)


@functools.cache
def _model_folders() -> tuple[Path, ...]:
    """Reads them once, as Gazebo does: reading all packages takes long in a large workspace."""
    return tuple(Path(path) for path in [*model_paths(), os.path.expanduser(HOME_MODELS)])


def _environment_paths() -> list[Path]:
    return [Path(path) for path in os.environ.get(RESOURCES, "").split(os.pathsep) if path]


def model_paths() -> list[str]:
    """Returns the existing folders of GAZEBO_MODEL_PATH, then those that packages export.

    A package exports folders, separated by colons, in its package.xml:
    ``<export><gazebo_ros gazebo_model_path="${prefix}/models"/></export>``.
    """
    folders = os.environ.get(MODELS, "").split(os.pathsep)
    packages = rospkg.RosPack()
    for name in packages.list():
        folders += _exported(packages.get_path(name))
    return [folder for folder in dict.fromkeys(folders) if folder and os.path.isdir(folder)]


def _exported(package: str) -> list[str]:
    # There may be hundreds of packages, and few export anything: only those are parsed.
    try:
        text = decode(read_file(Path(package, "package.xml")))
        if EXPORT not in text:
            return []
        root = parse(text)
    except FileError:  # a broken package of someone else's
        return []
    return [
        folder.replace("${prefix}", package)
        for element in root.iterfind("export/gazebo_ros")
        for folder in element.get(EXPORT, "").split(os.pathsep)
    ]


def find_world(name: str) -> Path | None:
    """Finds a world file: as given, on the resource paths and in package gazebo_ros, or in their folders
    `worlds`."""
    given = Path(os.path.expanduser(name))
    folders = _environment_paths()
    with contextlib.suppress(rospkg.ResourceNotFound):
        folders.append(Path(rospkg.RosPack().get_path("gazebo_ros")))
    tried = (given, *(f / given for f in folders), *(f / "worlds" / given for f in folders))
    try:
        return next((path for path in tried if path.is_file()), None)
    except (OSError, ValueError):  # no name for a file
        return None
