"""The running simulator: its services, models, joint states, and the environment that holds it."""

import contextlib
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol
from weakref import WeakSet

import rospy
from gazebo_msgs.srv import GetWorldProperties, SpawnModel
from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMsg
from sensor_msgs.msg import JointState as JointStateMsg

from robot_envs.backends.ros import node
from robot_envs.backends.world_files import world_models
from robot_envs.errors import RobotEnvError, SimulatorError, SimulatorFault, SimulatorHangs
from robot_envs.files import Source, is_text, locate, read_text
from robot_envs.robot import EMPTY, Robot
from robot_envs.scene import Scene
from robot_envs.task import Object
from robot_envs.world_state import Joints, JointState
from robot_sim.physics.pose import Pose
from ros_calls import master, service
from ros_calls.master import NoAnswer, Refused, living_address
from ros_utils import ros_gazebo

NODE = "/gazebo"
WORLD_SERVICE = "/gazebo/get_world_properties"
SPAWN_TIMEOUT = 60.0  # [s], of files that are read, plugins and sensors that start
STEP_SERVICE = "/gazebo/step_world"  # only a simulator in lock-step has it
Undo = Callable[[], object]


class SimulatorService(service.ServiceClient):
    """A service of the simulator, whose failures are raised as SimulatorFault or SimulatorHangs."""

    def begin(self, *request: Any) -> None:
        """Sends a request; `end` returns its response. A call does both."""
        try:
            super().begin(*request)
        except service.ServiceFailed as error:
            raise _fault(error) from error

    def end(self) -> Any:
        """Returns the response to the request that was begun."""
        try:
            return super().end()
        except service.ServiceFailed as error:
            raise _fault(error) from error


def _fault(error: service.ServiceFailed) -> SimulatorFault:
    hangs = isinstance(error, service.ServiceHangs)
    return SimulatorHangs(str(error)) if hangs else SimulatorFault(str(error))


def check_success(answer: Any, what: str) -> None:
    """Raises SimulatorError, which begins with `what`, unless an answer reports success."""
    if not answer.success:
        raise SimulatorError(f"{what}: {answer.status_message}")


class RunningSimulator:
    """Remembers the simulator that runs when it is made.

    As a context manager it explains errors: this process's node was shut down, or another simulator has
    taken the place of the one that was remembered.
    """

    def __init__(self) -> None:
        self._address = _registered_address()

    def is_registered(self) -> bool:
        """Returns whether the master still knows it."""
        return self._address is not None and self._address == _registered_address()

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if not isinstance(error, (SimulatorError, rospy.ROSException)):
            return
        if rospy.is_shutdown():
            raise SimulatorError(
                f"this process's ROS node {rospy.get_name()} was shut down from outside: another node has "
                f"taken its name, or it was killed ({error})"
            ) from error
        if self.is_registered():
            return
        with contextlib.suppress(NoAnswer):
            if living_address(NODE) is not None:
                raise SimulatorError(
                    f"the simulator has ended, and another one runs as {NODE} at {master.uri()} in its "
                    f"place; two at a time need two masters: set ROS_MASTER_URI ({error})"
                ) from error


def _registered_address() -> str | None:
    """Returns the address of the simulator's node, dead or alive."""
    try:
        return str(master.call("lookupNode", NODE))
    except (NoAnswer, Refused):
        return None


def simulator_answers() -> bool:
    """Returns whether a living simulator offers Gazebo's services; raises SimulatorHangs if it hangs."""
    if not node.service_is_registered(WORLD_SERVICE):
        return False
    try:
        models()
        return True
    except SimulatorHangs:
        raise
    except SimulatorError:  # registered by one that died
        return False


def lockstep_hint() -> str:
    """Returns why simulated time stands still, if the simulator is in lock-step; otherwise empty."""
    with contextlib.suppress(RobotEnvError):  # the master may be gone
        if node.service_is_registered(STEP_SERVICE):
            return (
                f"; the simulator is in lock-step (it offers {STEP_SERVICE}) and moves by its steps alone: "
                "start it with lockstep:=false paused:=false"
            )
    return ""


def world_path(source: Source | None, folder: Path) -> str | None:
    """Returns the world file for a simulator to be started; None: its default, a ground plane.

    A world that was given as text is written into `folder`.
    """
    if source is None or source == EMPTY:
        return None
    if not is_text(source):
        return str(locate(source))
    path = folder / "given.world"
    path.write_text(str(source), encoding="utf-8")
    return str(path)


def physics_step(wanted: float | None = None) -> float:
    """Returns the physics step [s], after setting the one wanted; raises RobotEnvError if that fails."""
    if wanted and not ros_gazebo.gazebo_set_time_step(wanted):
        raise RobotEnvError(f"the physics step can't be {wanted:g} s; see the messages above")
    step = ros_gazebo.gazebo_get_time_step()
    if not step > 0.0:
        raise RobotEnvError("the simulator doesn't report its time step; see the messages above")
    return step


def check_world(robot: Robot) -> None:
    """Raises RobotEnvError if the running simulator lacks a model of the robot's world file."""
    present = models()
    missing = [name for name in world_models(robot.world) if name not in present]
    if missing:
        raise RobotEnvError(
            f"the running simulator has another world than {robot.world}: there is no model "
            f"'{missing[0]}'; end it, and one is started with that world, or start it with world_name:="
        )


def models() -> list[str]:
    """Returns the names of the world's models; raises SimulatorError if the simulator doesn't answer."""
    return SimulatorService(WORLD_SERVICE, GetWorldProperties)().model_names


def spawn(name: str, text: str, pose: Pose, namespace: str = "") -> Undo:
    """Spawns a model, with its plugins in a namespace; returns the function that deletes it.

    Raises SimulatorError if the simulator refuses it, or doesn't answer.
    """
    kind = "urdf" if "<robot" in text else "sdf"
    at = PoseMsg(Point(*pose.position), Quaternion(*pose.orientation))
    call = SimulatorService(f"/gazebo/spawn_{kind}_model", SpawnModel, timeout=SPAWN_TIMEOUT)
    check_success(call(name, text, namespace, at, "world"), f"'{name}' can't be spawned")
    return lambda: ros_gazebo.gazebo_delete_model(name)


class SharedBackend(Protocol):
    """One of the backends that move the same robots."""

    scene: Scene

    def restore(self) -> None:
        """Undoes this backend's variations of the robots."""


class SharedWorld:
    """Knows which backend began the latest episode, and keeps its objects in the world.

    Models of the same names that were there before are used, and left there.
    """

    def __init__(self) -> None:
        self._holder: SharedBackend | None = None
        self._users: WeakSet[SharedBackend] = WeakSet()  # a dropped backend has left, too
        self._objects: list[Object] = []
        self._spawned: list[str] = []

    @property
    def is_used(self) -> bool:
        """Whether a backend has joined, and not left."""
        return bool(self._users)

    def join(self, user: SharedBackend) -> None:
        """Registers a backend, until `leave`."""
        self._users.add(user)

    def claim_if_free(self, user: SharedBackend) -> bool:
        """Claims the world unless another backend holds it; returns whether `user` holds it now."""
        if self._holder is None:
            self.claim(user)
        return self._holder is user

    def claim(self, user: SharedBackend) -> None:
        """Begins an episode: those of others end, and their variations are undone."""
        before, self._holder = self._holder, None  # no one's, if something fails
        if before is not None and before is not user:
            before.restore()
        self.place_objects(user.scene.objects)
        self._holder = user

    def leave(self, user: SharedBackend) -> None:
        """Unregisters a backend, and removes its objects."""
        self._users.discard(user)
        if self._holder is user:
            self._holder = None
            self.place_objects(())

    def check_holder(self, user: SharedBackend) -> None:
        """Raises SimulatorError if another backend has begun an episode since."""
        if self._holder is not user:
            raise SimulatorError(
                "another environment of this process has moved the same robot since this one's reset(); "
                "over ROS use them one after the other, each beginning with reset(), or each in a simulator "
                'of its own: backend="ros-own"'
            )

    def place_objects(self, wanted: Sequence[Object]) -> None:
        """Spawns these objects, in this order, in place of all others that were spawned here."""
        if list(wanted) == self._objects:
            return
        # All are spawned again: the order of a world's models affects its bits.
        self._remove_objects()
        try:
            present = models() if wanted else []
            for each in wanted:
                if each.name not in present:
                    spawn(each.name, read_text(each.file), each.pose)
                    self._spawned.append(each.name)
        except BaseException:
            self._remove_objects()
            raise
        self._objects = list(wanted)

    def _remove_objects(self) -> None:
        self._objects = []
        while self._spawned:
            ros_gazebo.gazebo_delete_model(self._spawned.pop())


class JointStateReader:
    """Reads a scene's joints from joint states, whose names may be plain or model::joint."""

    def __init__(self, scene: Scene) -> None:
        self._wanted = {
            scene.joint(robot, name): (name, f"{robot.model}::{name}", scene.several)
            for robot in scene.robots
            for name in robot.joints
        }
        self._names: Sequence[str] = []  # of the message before
        self._places: list[tuple[str, int]] = []

    def __call__(self, message: JointStateMsg) -> Joints:
        """Returns the joints of a message. See `read`."""
        return self.read(message.name, message.position, message.velocity, message.effort)

    def read(
        self,
        names: Sequence[str],
        positions: Sequence[float],
        velocities: Sequence[float],
        efforts: Sequence[float],
    ) -> Joints:
        """Returns the joints by name; raises SimulatorFault for a missing or infinite one."""
        if names != self._names:
            self._places = self._found(names)
            self._names = names
        total, joints = 0.0, Joints()
        try:
            for name, index in self._places:
                position, velocity = positions[index], velocities[index]
                effort = efforts[index] if efforts else 0.0
                joints[name] = JointState(position, velocity, effort)
                total += position + velocity
        except IndexError:
            raise SimulatorFault(f"a joint state has fewer numbers than names: {names}") from None
        if not math.isfinite(total):
            raise SimulatorFault(f"the joint state isn't finite: {joints}")
        return joints

    def _found(self, names: Sequence[str]) -> list[tuple[str, int]]:
        places, missing = [], []
        for key, (plain, full, several) in self._wanted.items():
            if full in names:
                places.append((key, names.index(full)))
            elif plain in names and not several:
                places.append((key, names.index(plain)))
            else:
                missing.append(key)
        if missing:
            raise SimulatorFault(f"the joint state lacks {' and '.join(missing)}; it has: {list(names)}")
        return places
