"""A robot in a running simulator: its model and its controllers, brought up where missing."""

import contextlib
import os
import sys
from collections.abc import Callable

import rospy
from controller_manager_msgs.srv import ListControllers
from gazebo_msgs.srv import GetModelState, GetWorldProperties

from robot_envs.backends import node
from robot_envs.backends.service import ServiceClient
from robot_envs.errors import RobotEnvError, SimulatorError, SimulatorHangs
from robot_envs.robot import Robot, State
from ros_calls.waiting import wait_until
from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf
from ros_utils.readiness import NotReady, Ready

WORLD_SERVICE = "/gazebo/get_world_properties"
STEP_SERVICE = "/gazebo/step_world"  # of a simulator in lock-step
SIMULATOR_TIMEOUT = 60.0  # [s]
READY_TIMEOUT = 30.0  # [s] for controllers that were started to run
_ROUNDING = 1e-6  # [m]
Say = Callable[[str], None]
Undo = Callable[[], object]


def simulator_answers() -> bool:
    """Whether a living simulator offers Gazebo's services.

    Raises:
        SimulatorHangs: if there is one that doesn't answer.
    """
    if not node.service_is_registered(WORLD_SERVICE):
        return False
    try:
        _models()
        return True
    except SimulatorHangs:
        raise
    except SimulatorError:  # registered by one that died
        return False


def bring_up(robot: Robot[State], say: Say, height: float = 0.0) -> list[Undo]:
    """Spawns a robot and starts its controllers, each only if it isn't there.

    Args:
        robot: the robot.
        say: is told what is done.
        height: where to spawn it, above the ground [m].

    Returns:
        What undoes the changes made, in the order in which they were made.

    Raises:
        RobotEnvError: if something can't be loaded, spawned or started.
    """
    changes = [*_bring_model(robot, say, height), *_bring_controllers(robot, say)]
    try:
        ready(robot).wait(READY_TIMEOUT)
    except NotReady as error:
        raise RobotEnvError(f"the robot is {error}") from error
    return changes


def ready(robot: Robot[State]) -> Ready:
    """What has to be there for a robot to be used."""
    return Ready([robot.model], [robot.over_ros.publisher, *robot.controllers])


def _models() -> list[str]:
    return ServiceClient(WORLD_SERVICE, GetWorldProperties)().model_names


def _bring_model(robot: Robot[State], say: Say, height: float) -> list[Undo]:
    if robot.model in _models():
        return []
    say("spawning the robot")
    known = robot.over_ros
    # By path: packages of the user's may have the names of this checkout's.
    if not ros_urdf.urdf_load_from_path(str(robot.urdf_file()), known.description, ns="/"):
        raise RobotEnvError("the robot's URDF can't be loaded; see the messages above")
    answer = ros_gazebo.gazebo_spawn_urdf_param(
        known.description, model_name=robot.model, pos_z=height
    )
    succeeded, text = answer if isinstance(answer, tuple) else (answer, "see the messages above")
    if not succeeded:
        raise RobotEnvError(f"the robot can't be spawned: {text}")
    return [lambda: ros_gazebo.gazebo_delete_model(robot.model)]


def check_height(robot: Robot[State], height: float) -> None:
    """Makes sure that a robot stands at least that high above the ground [m].

    Raises:
        RobotEnvError: if it doesn't.
    """
    if height <= 0.0:
        return
    answer = ServiceClient("/gazebo/get_model_state", GetModelState)(robot.model, "world")
    found = answer.pose.position.z
    if not answer.success or found < height - _ROUNDING:
        raise RobotEnvError(
            f"the robot stands {found:g} m above the ground, which it would hit; this task needs "
            f"{height:g} m: delete the model '{robot.model}' and it is spawned there"
        )


def _bring_controllers(robot: Robot[State], say: Say) -> list[Undo]:
    wanted = [robot.over_ros.publisher, *robot.controllers]
    states = _controller_states()
    missing = [name for name in wanted if name not in states]
    stopped = [name for name in wanted if states.get(name, "running") != "running"]
    undo: list[Undo] = []
    if missing:
        say(f"starting {', '.join(missing)}")
        _load_controllers(robot, missing)
        undo.append(lambda: ros_controllers.kill_controllers_srv(missing))
    if stopped:
        say(f"starting {', '.join(stopped)}")
        if not ros_controllers.start_controllers_srv(stopped):
            raise RobotEnvError(f"can't start the controllers {', '.join(stopped)}")
        undo.append(lambda: ros_controllers.stop_controllers_srv(stopped))
    return undo


def _load_controllers(robot: Robot[State], names: list[str]) -> None:
    if not ros_params.ros_load_yaml_from_path(str(robot.parameters_file()), ns="/"):
        raise RobotEnvError("the controllers' parameters can't be loaded; see the messages above")
    if not ros_controllers.spawn_controllers_srv(names):
        raise RobotEnvError(f"can't start the controllers {', '.join(names)}")


def _controller_states() -> dict[str, str]:
    """Name and state of each loaded controller.

    Raises:
        SimulatorError: if the robot has no controller manager.
    """
    answer = ServiceClient("/controller_manager/list_controllers", ListControllers)()
    return {controller.name: controller.state for controller in answer.controller}


def spawn_command(robot: Robot[State], argv: list[str]) -> int:
    """The command spawn_robot.py: waits for a simulator, brings the robot up, ends.

    Returns:
        The exit code; a failure is one line.
    """
    try:
        name = node.full_name(argv, "spawn_robot")
        rospy.init_node(os.path.basename(name), argv=["", *argv], disable_signals=True)
        _wait_for_simulator()
        bring_up(robot, rospy.loginfo)
        return 0
    except RobotEnvError as error:
        print(f"spawn_robot: {error}", file=sys.stderr)
        return 1
    except (KeyboardInterrupt, rospy.ROSInterruptException):
        return 130
    finally:
        with contextlib.suppress(Exception):
            rospy.signal_shutdown("done")


def _wait_for_simulator() -> None:
    if not wait_until(simulator_answers, SIMULATOR_TIMEOUT, "a simulator"):
        raise RobotEnvError(
            f"no simulator offered {WORLD_SERVICE} within {SIMULATOR_TIMEOUT:g} s; "
            "start one with roslaunch gazebo_ros empty_world.launch"
        )
