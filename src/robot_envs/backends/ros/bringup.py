"""Bring-up of robots in a running simulator: models, parameters and controllers."""

import contextlib
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any

import rospy
from controller_manager_msgs.srv import ListControllers

from robot_envs.backends.ros import node, running
from robot_envs.backends.ros.running import WORLD_SERVICE, SimulatorService, Undo
from robot_envs.controllers import CommandPort
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from ros_calls import master
from ros_calls.master import NoAnswer, Refused
from ros_calls.waiting import wait_until
from ros_utils import ros_controllers
from ros_utils.readiness import NotReady, Ready

SIMULATOR_TIMEOUT = 60.0  # [s]
READY_TIMEOUT = 30.0  # [s] for controllers that were started to run
# For a robot that describes none.
PUBLISHER = {"type": "joint_state_controller/JointStateController", "publish_rate": 1000}
Say = Callable[[str], None]


def bring_up(scene: Scene, say: Say) -> list[Undo]:
    """Spawns robots and starts their controllers, where they are missing; `say` reports each step.

    Returns the functions that undo the changes, in the order of these; raises RobotEnvError if something
    fails.
    """
    changes = [
        undo
        for robot in scene.robots
        for undo in (*_bring_model(robot, say), *_bring_controllers(robot, say))
    ]
    try:
        ready(scene).wait(READY_TIMEOUT)
    except NotReady as error:
        raise RobotEnvError(f"the robot is {error}") from error
    return changes


def full_name(robot: Robot, name: str) -> str:
    """Returns the name of a controller, topic or parameter in the robot's namespace."""
    return str(rospy.names.ns_join(f"/{robot.namespace.strip('/')}", name))


def command_publisher(robot: Robot, port: CommandPort) -> rospy.Publisher:
    """Advertises the topic on which a controller takes commands."""
    topic = f"{full_name(robot, port.name)}/{port.kind.topic}"
    return rospy.Publisher(topic, port.kind.message_type, queue_size=1)


def ready(scene: Scene) -> Ready:
    """Returns the models and controllers that have to exist before robots can be used."""
    wanted = [(robot, name) for robot in scene.robots for name in (robot.publisher, *robot.run)]
    models = [robot.model for robot in scene.robots]
    return Ready(models, list(dict.fromkeys(full_name(*each) for each in wanted)))


def _bring_model(robot: Robot, say: Say) -> list[Undo]:
    if robot.model in running.models():
        return []
    say(f"spawning the robot '{robot.model}'")
    # Set before the robot is spawned, whose drives read them; as text, since a package of the user's may have
    # the name of one of ours.
    for name, value in robot.parameters.items():
        _set_parameter(full_name(robot, name), value)
    _set_parameter(full_name(robot, robot.description), robot.xml)
    return [running.spawn(robot.model, robot.xml, robot.pose, f"/{robot.namespace.strip('/')}")]


def _bring_controllers(robot: Robot, say: Say) -> list[Undo]:
    namespace = f"/{robot.namespace.strip('/')}"
    wanted = list(dict.fromkeys([robot.publisher, *robot.run]))
    states = _controller_states(robot)
    missing = [name for name in wanted if name not in states]
    stopped = [name for name in wanted if states.get(name, "running") != "running"]
    undo: list[Undo] = []
    if missing:
        say(f"starting {', '.join(missing)}")
        _describe(robot, missing)
        if not ros_controllers.spawn_controllers_srv(missing, namespace):
            raise RobotEnvError(f"can't start the controllers {', '.join(missing)}")
        undo.append(lambda: ros_controllers.kill_controllers_srv(missing, namespace))
    if stopped:
        say(f"starting {', '.join(stopped)}")
        if not ros_controllers.start_controllers_srv(stopped, namespace):
            raise RobotEnvError(f"can't start the controllers {', '.join(stopped)}")
        undo.append(lambda: ros_controllers.stop_controllers_srv(stopped, namespace))
    return undo


def _set_parameter(name: str, value: Any) -> None:
    """Sets a parameter at the current master; rospy always asks the first one of the process."""
    try:
        master.call("setParam", name, value)
    except (NoAnswer, Refused, OverflowError) as error:  # an integer too large for XML-RPC
        raise RobotEnvError(f"the parameter {name} can't be set: {error}") from error


def _describe(robot: Robot, names: Sequence[str]) -> None:
    """Sets the parameters of controllers where the controller manager looks for them."""
    for name in names:
        described = robot.parameters.get(name)
        if described is None and name == robot.publisher:
            described = PUBLISHER
        if described is not None:
            _set_parameter(full_name(robot, name), described)


def _controller_states(robot: Robot) -> dict[str, str]:
    """Returns each loaded controller's state, by name; raises SimulatorError without a controller manager."""
    service = full_name(robot, "controller_manager/list_controllers")
    if not wait_until(lambda: node.service_is_registered(service), READY_TIMEOUT, service):
        raise SimulatorError(
            f"the robot '{robot.model}' has no controller manager ({service}): its URDF needs the plugin "
            "libgazebo_ros_control.so, with that namespace"
        )
    answer = SimulatorService(service, ListControllers)()
    return {controller.name: controller.state for controller in answer.controller}


def spawn_command(robot: Robot, argv: list[str]) -> int:
    """Runs the command spawn_robot.py; returns the exit code."""
    try:
        name = node.full_name(argv, "spawn_robot")
        rospy.init_node(os.path.basename(name), argv=["", *argv], disable_signals=True)
        if not wait_until(running.simulator_answers, SIMULATOR_TIMEOUT, "a simulator"):
            raise RobotEnvError(
                f"no simulator offered {WORLD_SERVICE} within {SIMULATOR_TIMEOUT:g} s; "
                "start one with roslaunch gazebo_ros empty_world.launch"
            )
        bring_up(Scene([robot]), rospy.loginfo)
        return 0
    except RobotEnvError as error:
        print(f"spawn_robot: {error}", file=sys.stderr)
        return 1
    except (KeyboardInterrupt, rospy.ROSInterruptException):
        return 130
    finally:
        with contextlib.suppress(Exception):
            rospy.signal_shutdown("done")
