"""Executable `spawner` of package controller_manager: loads and starts controllers, and keeps them.

It stays until it is shut down, and then stops and unloads its controllers (ros_control.md section
2).
"""

import argparse
import os
import threading
from collections.abc import Sequence

import rosparam
import rospy
import yaml
from std_msgs.msg import Bool

from bullet_gazebo.ros.manager_client import STRICT, CallFailed, ManagerClient

SERVICES = ("load_controller", "switch_controller", "unload_controller")
FAREWELL = 3.0  # [s] for each call during shutdown; the simulator may have gone before us


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the spawner until its node is shut down.

    Returns:
        The exit code: 0, or 1 if no controller manager was found or a file can't be read.
    """
    options = _parse(rospy.myargv(argv)[1:])
    rospy.init_node("spawner", anonymous=True, argv=None if argv is None else list(argv))
    manager = ManagerClient(options.namespace)
    try:
        if options.wait_for:
            _wait_for_topic(options.wait_for, options.timeout)
        missing = manager.wait(SERVICES, options.timeout)
        if missing:
            rospy.logwarn(
                "Controller Spawner couldn't find the expected controller_manager ROS interface:"
                " no service %s",
                missing,
            )
            return 1
        names = [name for each in options.controllers for name in _names(each, options.namespace)]
        _run(manager, names, options.stopped)
    except (ValueError, OSError) as fault:
        rospy.logerr("Controller Spawner: %s", fault)
        return 1
    except rospy.ROSInterruptException:
        pass  # shut down while it waited
    return 0


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="spawner", description="Load, start and keep controllers")
    parser.add_argument("--stopped", action="store_true", help="load, but don't start")
    parser.add_argument("--wait-for", metavar="TOPIC", help="first wait for true on a Bool topic")
    parser.add_argument("--namespace", default="", help="of the controller manager")
    parser.add_argument("--timeout", type=float, default=30.0, help="for services [s]; <= 0: none")
    parser.add_argument("--no-timeout", action="store_true", help="wait for ever")
    parser.add_argument("--shutdown-timeout", type=float, help="ignored")
    parser.add_argument("controllers", nargs="+", help="names, or YAML files of controllers")
    options = parser.parse_args(arguments)
    if options.no_timeout or options.timeout <= 0:
        options.timeout = None
    return options


def _wait_for_topic(topic: str, timeout: float | None) -> None:
    """Waits for `true`; goes on without it after the time limit."""
    arrived = threading.Event()

    def hear(message: Bool) -> None:
        if message.data:
            arrived.set()

    rospy.loginfo("Controller Spawner: Waiting for true on %s", topic)
    listener = rospy.Subscriber(topic, Bool, hear)
    waited = 0.0
    while not arrived.wait(0.1):
        waited += 0.1
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException("shut down")
        if timeout is not None and waited > timeout:
            rospy.logwarn("Controller Spawner: no true on %s in %g s; going on", topic, timeout)
            break
    listener.unregister()


def _names(argument: str, namespace: str) -> list[str]:
    """Returns the controllers that an argument stands for: itself, or those of a YAML file.

    A file's parameters are loaded first.

    Raises:
        ValueError, OSError: the file can't be read, or is no YAML mapping.
    """
    if not os.path.isfile(argument):
        return [argument]
    try:
        with open(argument, encoding="utf-8") as file:
            documents = rosparam.load_str(file.read(), argument)
    except (yaml.YAMLError, TypeError) as fault:
        raise ValueError(f"{argument}: {' '.join(str(fault).split())}") from fault
    if not all(isinstance(parameters, dict) for parameters, _ in documents):
        raise ValueError(f"{argument}: expected a mapping from controller names to parameters")
    for parameters, _ in documents:
        rosparam.upload_params(rospy.resolve_name(namespace), parameters)
    return [str(name) for parameters, _ in documents for name in parameters]


def _run(manager: ManagerClient, names: Sequence[str], stopped: bool) -> None:
    loaded: list[str] = []
    # First of all: a shutdown in the middle of the loading unloads what has been loaded by then.
    rospy.on_shutdown(lambda: _leave(manager, loaded))
    for name in names:
        _load(manager, name, loaded)
    rospy.loginfo("Controller Spawner: Loaded controllers: %s", ", ".join(loaded))
    if not stopped:
        _start(manager, loaded)
    rospy.spin()


def _load(manager: ManagerClient, name: str, loaded: list[str]) -> None:
    rospy.loginfo("Loading controller: %s", name)
    try:
        if manager.load(name):
            loaded.append(name)
        else:
            rospy.logerr("Failed to load %s", name)
    except CallFailed as fault:
        rospy.logerr("Failed to load %s: %s", name, fault)


def _start(manager: ManagerClient, loaded: Sequence[str]) -> None:
    try:
        if manager.switch(loaded, [], STRICT):
            rospy.loginfo("Started controllers: %s", ", ".join(loaded))
        else:
            rospy.logerr("Failed to start controllers: %s", ", ".join(loaded))
    except CallFailed as fault:
        rospy.logerr("Failed to start controllers: %s: %s", ", ".join(loaded), fault)


def _leave(manager: ManagerClient, loaded: Sequence[str]) -> None:
    """Stops the running ones of our controllers and unloads all, last one first."""
    if not loaded:
        return
    rospy.loginfo("Shutting down spawner. Stopping and unloading controllers...")
    try:
        # Somebody else may have stopped one: asking to stop that too would leave all the others on.
        running = [name for name in manager.running(FAREWELL) if name in loaded]
        manager.switch([], running, STRICT, FAREWELL)
        for name in reversed(loaded):
            manager.unload(name, FAREWELL)
            rospy.loginfo("Unloaded %s", name)
    except CallFailed as fault:
        rospy.loginfo("Controller Spawner: left as they are: %s", fault)
