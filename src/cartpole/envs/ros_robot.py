"""The robot in a running simulator: its model and its controllers, brought up where missing."""

import contextlib
import os
import sys
import time
from collections.abc import Callable

import rospy
from controller_manager_msgs.srv import ListControllers
from gazebo_msgs.srv import GetModelState, GetWorldProperties

from cartpole.envs import ros_node
from cartpole.envs.robot_names import CONTROLLER, DESCRIPTION, MODEL
from cartpole.envs.ros_service import ServiceClient
from cartpole.errors import CartpoleError, SimulatorError, SimulatorHangs
from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf

CONTROLLERS = ["joint_state_controller", CONTROLLER]
WORLD_SERVICE = "/gazebo/get_world_properties"
SIMULATOR_TIMEOUT = 60.0  # [s]
_ROUNDING = 1e-6  # [m]
Say = Callable[[str], None]
Undo = Callable[[], object]


def simulator_answers() -> bool:
    """Whether a living simulator offers Gazebo's services.

    Raises:
        SimulatorHangs: if there is one that doesn't answer.
    """
    if not ros_node.service_is_registered(WORLD_SERVICE):
        return False
    try:
        _models()
        return True
    except SimulatorHangs:
        raise
    except SimulatorError:  # registered by one that died
        return False


def bring_up(say: Say, height: float = 0.0) -> list[Undo]:
    """Spawns the robot and starts its controllers, each only if it isn't there.

    Args:
        height: where to spawn it, above the ground [m].

    Returns:
        What undoes the changes made, in the order in which they were made.

    Raises:
        CartpoleError: if something can't be loaded, spawned or started.
    """
    return [*_bring_model(say, height), *_bring_controllers(say)]


def _models() -> list[str]:
    return ServiceClient(WORLD_SERVICE, GetWorldProperties)().model_names


def _bring_model(say: Say, height: float) -> list[Undo]:
    if MODEL in _models():
        return []
    say("spawning the robot")
    loaded = ros_urdf.urdf_load_from_pkg(
        "cartpole_gazebo", "cartpole_v1.urdf", DESCRIPTION, folder="/robots", ns="/"
    )
    if not loaded:
        raise CartpoleError("the robot's URDF can't be loaded; see the messages above")
    answer = ros_gazebo.gazebo_spawn_urdf_param(DESCRIPTION, model_name=MODEL, pos_z=height)
    succeeded, text = answer if isinstance(answer, tuple) else (answer, "see the messages above")
    if not succeeded:
        raise CartpoleError(f"the robot can't be spawned: {text}")
    return [lambda: ros_gazebo.gazebo_delete_model(MODEL)]


def check_height(height: float) -> None:
    """Makes sure that the robot stands at least that high above the ground [m].

    Raises:
        CartpoleError: if it doesn't.
    """
    if height <= 0.0:
        return
    answer = ServiceClient("/gazebo/get_model_state", GetModelState)(MODEL, "world")
    found = answer.pose.position.z
    if not answer.success or found < height - _ROUNDING:
        raise CartpoleError(
            f"the robot stands {found:g} m above the ground, where its hanging pole would hit it; "
            f"this task needs {height:g} m: delete the model '{MODEL}' and it is spawned there"
        )


def _bring_controllers(say: Say) -> list[Undo]:
    states = _controller_states()
    missing = [name for name in CONTROLLERS if name not in states]
    stopped = [name for name in CONTROLLERS if states.get(name, "running") != "running"]
    undo: list[Undo] = []
    if missing:
        say(f"starting {', '.join(missing)}")
        _load_controllers(missing)
        undo.append(lambda: ros_controllers.kill_controllers_srv(missing))
    if stopped:
        say(f"starting {', '.join(stopped)}")
        if not ros_controllers.start_controllers_srv(stopped):
            raise CartpoleError(f"can't start the controllers {', '.join(stopped)}")
        undo.append(lambda: ros_controllers.stop_controllers_srv(stopped))
    return undo


def _load_controllers(names: list[str]) -> None:
    if not ros_params.ros_load_yaml_from_pkg(
        "cartpole_controller", "joint_position_control.yaml", ns="/"
    ):
        raise CartpoleError("the controllers' parameters can't be loaded; see the messages above")
    if not ros_controllers.spawn_controllers_srv(names):
        raise CartpoleError(f"can't start the controllers {', '.join(names)}")


def _controller_states() -> dict[str, str]:
    """Name and state of each loaded controller.

    Raises:
        SimulatorError: if the robot has no controller manager.
    """
    answer = ServiceClient("/controller_manager/list_controllers", ListControllers)()
    return {controller.name: controller.state for controller in answer.controller}


def main() -> int:
    """The command spawn_robot.py: waits for a simulator, brings the robot up, ends."""
    argv = sys.argv[1:]
    try:
        name = ros_node.full_name(argv, "spawn_robot")
        rospy.init_node(os.path.basename(name), argv=sys.argv, disable_signals=True)
        _wait_for_simulator()
        bring_up(rospy.loginfo)
        return 0
    except CartpoleError as error:
        print(f"spawn_robot: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    finally:
        with contextlib.suppress(Exception):
            rospy.signal_shutdown("done")


def _wait_for_simulator() -> None:
    deadline = time.monotonic() + SIMULATOR_TIMEOUT
    while not simulator_answers():
        if time.monotonic() > deadline:
            raise CartpoleError(
                f"no simulator offered {WORLD_SERVICE} within {SIMULATOR_TIMEOUT:g} s; "
                "start one with roslaunch gazebo_ros empty_world.launch"
            )
        time.sleep(0.2)
