"""The world of a simulator: whether it is there and fits, its file and its step, what stands in it."""

import contextlib
from collections.abc import Callable

from gazebo_msgs.srv import GetWorldProperties, SpawnModel
from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMsg

from bullet_gazebo.physics.pose import Pose
from robot_envs.backends.ros import node
from robot_envs.backends.ros.service import ServiceClient
from robot_envs.backends.world_files import world_models
from robot_envs.description.files import Source, is_text, locate
from robot_envs.errors import RobotEnvError, SimulatorError, SimulatorHangs
from robot_envs.robot import EMPTY, Robot
from ros_utils import ros_gazebo

WORLD_SERVICE = "/gazebo/get_world_properties"
STEP_SERVICE = "/gazebo/step_world"  # of a simulator in lock-step
Undo = Callable[[], object]


def simulator_answers() -> bool:
    """Whether a living simulator offers Gazebo's services.

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
    """For who waits in vain for a simulation to go on by itself; empty where that isn't the reason."""
    with contextlib.suppress(RobotEnvError):  # without its master nobody knows
        if node.service_is_registered(STEP_SERVICE):
            return (
                f"; the simulator is in lock-step (it offers {STEP_SERVICE}) and moves by its steps alone: "
                "start it with lockstep:=false paused:=false"
            )
    return ""


def world_path(source: Source | None, write: Callable[[str], str]) -> str | None:
    """The world file for a simulator of ours; None: its own, with a ground plane.

    Args:
        source: the robot's world.
        write: puts a world that was given as text into a file; returns its path.
    """
    if source is None or source == EMPTY:
        return None
    return write(str(source)) if is_text(source) else str(locate(source))


def physics_step() -> float:
    """The simulator's [s].

    Raises:
        RobotEnvError: if it doesn't tell.
    """
    step = ros_gazebo.gazebo_get_time_step()
    if not step > 0.0:
        raise RobotEnvError("the simulator doesn't tell its time step; see the messages above")
    return step


def check_world(robot: Robot) -> None:
    """Makes sure that a simulator that runs has what the robot's world file brings.

    Raises:
        RobotEnvError: if it hasn't.
    """
    there = models()
    missing = [name for name in world_models(robot.world) if name not in there]
    if missing:
        raise RobotEnvError(
            f"the running simulator has another world than {robot.world}: there is no model "
            f"'{missing[0]}'; end it, and one is started with that world, or start it with world_name:="
        )


def models() -> list[str]:
    """Names of what is in the world.

    Raises:
        SimulatorError: if the simulator doesn't answer.
    """
    return ServiceClient(WORLD_SERVICE, GetWorldProperties)().model_names


def spawn(name: str, text: str, pose: Pose, namespace: str = "") -> Undo:
    """Adds a model.

    Args:
        name: of the model.
        text: its URDF or SDF.
        pose: in the world.
        namespace: of what its plugins offer.

    Returns:
        What takes it away.

    Raises:
        RobotEnvError: if it is refused.
        SimulatorError: if the simulator doesn't answer.
    """
    kind = "urdf" if "<robot" in text else "sdf"
    at = PoseMsg(Point(*pose.position), Quaternion(*pose.orientation))
    answer = ServiceClient(f"/gazebo/spawn_{kind}_model", SpawnModel)(
        name, text, namespace, at, "world"
    )
    if not answer.success:
        raise RobotEnvError(f"'{name}' can't be spawned: {answer.status_message}")
    return lambda: ros_gazebo.gazebo_delete_model(name)
