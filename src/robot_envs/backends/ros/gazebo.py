"""The running simulator: calls to it, whether it is still the same one, and what is in its world."""

import contextlib
from collections.abc import Callable
from types import TracebackType
from typing import Any

import rospy
from gazebo_msgs.srv import GetWorldProperties, SpawnModel
from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMsg

from bullet_gazebo.physics.pose import Pose
from robot_envs.backends.ros import node
from robot_envs.backends.world_files import world_models
from robot_envs.errors import RobotEnvError, SimulatorError, SimulatorFault, SimulatorHangs
from robot_envs.files import Source, is_text, locate
from robot_envs.robot import EMPTY, Robot
from ros_calls import master, service
from ros_calls.master import NoAnswer, Refused, living_address
from ros_utils import ros_gazebo

NODE = "/gazebo"
WORLD_SERVICE = "/gazebo/get_world_properties"
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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
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
    """Returns whether a living simulator offers Gazebo's services.

    Raises:
        SimulatorHangs: if there is one that doesn't answer.
    """
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


def world_path(source: Source | None, write: Callable[[str], str]) -> str | None:
    """Returns the world file for a simulator to be started; None: its default, a ground plane.

    Args:
        source: the robot's world.
        write: writes a world that was given as text to a file, and returns its path.
    """
    if source is None or source == EMPTY:
        return None
    return write(str(source)) if is_text(source) else str(locate(source))


def physics_step() -> float:
    """Returns the simulator's physics step [s].

    Raises:
        RobotEnvError: if it doesn't answer.
    """
    step = ros_gazebo.gazebo_get_time_step()
    if not step > 0.0:
        raise RobotEnvError("the simulator doesn't tell its time step; see the messages above")
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
    """Returns the names of the models in the world.

    Raises:
        SimulatorError: if the simulator doesn't answer.
    """
    return SimulatorService(WORLD_SERVICE, GetWorldProperties)().model_names


def spawn(name: str, text: str, pose: Pose, namespace: str = "") -> Undo:
    """Spawns a model.

    Args:
        name: of the model.
        text: its URDF or SDF.
        pose: in the world.
        namespace: of the topics and services of its plugins.

    Returns:
        What deletes it.

    Raises:
        RobotEnvError: if the simulator refuses it, or doesn't answer.
    """
    kind = "urdf" if "<robot" in text else "sdf"
    at = PoseMsg(Point(*pose.position), Quaternion(*pose.orientation))
    call = SimulatorService(f"/gazebo/spawn_{kind}_model", SpawnModel)
    answer = call(name, text, namespace, at, "world")
    if not answer.success:
        raise RobotEnvError(f"'{name}' can't be spawned: {answer.status_message}")
    return lambda: ros_gazebo.gazebo_delete_model(name)
