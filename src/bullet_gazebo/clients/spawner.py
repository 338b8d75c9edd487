"""The commands `spawner` and `unspawner` of package controller_manager (docs/contract/ros_control.md 2).

spawner loads and starts controllers, and stays until it is shut down; then it stops and unloads them.
unspawner stops controllers, again whenever someone starts them; when it is shut down, it starts those that
it stopped.
"""

import argparse
import functools
import math
import os
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import rosparam
import rospy
from controller_manager_msgs import srv
from std_msgs.msg import Bool

from bullet_gazebo.common.node_process import SignalHandler, init_node
from file_access.content import FileError, read_file
from file_access.yaml_text import load_parameters
from ros_calls.absence import spawns
from ros_calls.service import ServiceClient, ServiceFailed, ServiceGone
from ros_calls.waiting import service_comes_up, wait_until

BEST_EFFORT = srv.SwitchControllerRequest.BEST_EFFORT
STRICT = srv.SwitchControllerRequest.STRICT
PERIOD = 3.0  # [s of wall time]: simulated time may jump back
MANAGER_PATIENCE = 30.0  # [s] for the services to come up
ANSWER = 10.0  # [s] for one call of unspawner's
SERVICES = ("load_controller", "switch_controller", "unload_controller")
FAREWELL = 3.0  # [s] for a call during shutdown; the simulator may have gone before us


class ManagerClient:
    """The services of the controller manager in one namespace. A call raises ServiceFailed."""

    def __init__(self, namespace: str = "", user: str = "Controller Spawner") -> None:
        """`user` names the waiting program in the log."""
        self._user = user
        self._prefix = f"{namespace.rstrip('/')}/controller_manager" if namespace else "controller_manager"

    def wait(self, services: Sequence[str], timeout: float) -> str | None:
        """Waits for the manager's services, each at most `timeout` [s of wall time], or infinity.

        Returns the first one that isn't offered in time, or None.
        """
        for service in services:
            name = str(rospy.resolve_name(f"{self._prefix}/{service}"))
            rospy.loginfo("%s: Waiting for service %s/%s", self._user, self._prefix, service)
            if not service_comes_up(name, timeout):
                return name
        return None

    def load(self, name: str, timeout: float = math.inf) -> bool:
        return bool(self._call("load_controller", srv.LoadController, name, timeout=timeout).ok)

    def unload(self, name: str, timeout: float = math.inf) -> bool:
        return bool(self._call("unload_controller", srv.UnloadController, name, timeout=timeout).ok)

    def switch(
        self, start: Sequence[str], stop: Sequence[str], strictness: int, timeout: float = math.inf
    ) -> bool:
        """Starts and stops controllers in one step; no time limit for the manager itself."""
        request = (list(start), list(stop), strictness, False, 0.0)
        return bool(self._call("switch_controller", srv.SwitchController, *request, timeout=timeout).ok)

    def running(self, timeout: float = math.inf) -> list[str]:
        """Returns the names of the running controllers."""
        answer = self._call("list_controllers", srv.ListControllers, timeout=timeout)
        return [each.name for each in answer.controller if each.state == "running"]

    def _call(self, service: str, kind: Any, *request: Any, timeout: float) -> Any:
        return ServiceClient(f"{self._prefix}/{service}", kind, timeout=timeout)(*request)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs spawner; returns its exit code: 0, or 1 if no manager was found or a file can't be read."""
    command_line = list(sys.argv if argv is None else argv)
    options = _parse(rospy.myargv(command_line)[1:])

    def work() -> int:
        init_node("spawner", command_line)
        try:
            return _work(ManagerClient(options.namespace), options)
        except FileError as fault:
            rospy.logerr("Controller Spawner: %s", fault)
            return 1

    return SignalHandler().run(work, interrupted=0)


def _work(manager: ManagerClient, options: argparse.Namespace) -> int:
    if options.wait_for:
        _wait_for_topic(options.wait_for, options.timeout)
    missing = _find(manager, options.timeout)
    if missing:
        rospy.logwarn(
            "Controller Spawner couldn't find the expected controller_manager ROS interface: no service %s",
            missing,
        )
        return 1
    names = [name for each in options.controllers for name in _names(each, options.namespace)]
    _Spawner(manager).run(names, options.stopped)
    return 0


def _find(manager: ManagerClient, timeout: float) -> str | None:
    """Waits for the manager; returns the service still missing at the time limit, or None.

    While simulated time is zero, the simulator isn't ready yet, and the wait starts over; also where a model
    is being spawned, or has been meanwhile.
    """
    before = spawns()
    while missing := manager.wait(SERVICES, timeout):
        now = spawns()
        if now[:1] > [0] or now != before:
            reason = "a model is being spawned"
        elif rospy.get_param("/use_sim_time", False) and not rospy.get_rostime():
            reason = "simulated time hasn't begun"
        else:
            return missing
        before = now
        rospy.logwarn("Controller Spawner: still waiting for %s, as %s", missing, reason)
    return None


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="spawner", description="Load, start and keep controllers")
    parser.add_argument("--stopped", action="store_true", help="load, but don't start")
    parser.add_argument("--wait-for", metavar="TOPIC", help="first wait for true on a Bool topic")
    parser.add_argument("--namespace", default="", help="namespace of the controller manager")
    parser.add_argument("--timeout", type=float, default=30.0, help="time limit for services [s]; <= 0: none")
    parser.add_argument("--no-timeout", action="store_true", help="wait forever")
    parser.add_argument("--shutdown-timeout", type=float, help="ignored")
    parser.add_argument("controllers", nargs="+", help="names, or YAML files of controllers")
    options = parser.parse_intermixed_args(arguments)
    if options.no_timeout or options.timeout <= 0:
        options.timeout = math.inf
    return options


def _wait_for_topic(topic: str, timeout: float) -> None:
    """Waits for `true`; continues without it after the time limit."""
    arrived = threading.Event()

    def hear(message: Bool) -> None:
        if message.data:
            arrived.set()

    rospy.loginfo("Controller Spawner: Waiting for true on %s", topic)
    listener = rospy.Subscriber(topic, Bool, hear)
    if not wait_until(arrived.is_set, timeout, f"true on {topic}"):
        rospy.logwarn("Controller Spawner: no true on %s in %g s; continuing", topic, timeout)
    listener.unregister()


def _names(argument: str, namespace: str) -> list[str]:
    """Returns the controller of an argument, or those of a YAML file, whose parameters it loads."""
    if not os.path.isfile(argument):
        return [argument]
    try:
        documents = load_parameters(read_file(Path(argument)))
    except FileError as fault:
        raise FileError(f"{argument}: {fault}") from fault
    for parameters in documents:
        parameters.pop(rosparam.NS, None)
        rosparam.upload_params(rospy.resolve_name(namespace), parameters)
    return [str(name) for parameters in documents for name in parameters]


class _Spawner:
    """Loads and starts controllers, and unloads them when the node is shut down."""

    def __init__(self, manager: ManagerClient) -> None:
        self._manager = manager
        self._loaded: list[str] = []
        self._leaving = False
        self._turn = threading.Lock()  # held while the manager does something for us

    def run(self, names: Sequence[str], stopped: bool) -> None:
        """Runs until the node is shut down."""
        # First: a shutdown in the middle of loading unloads what has been loaded by then.
        rospy.on_shutdown(self._leave)
        for name in names:
            self._in_turn(functools.partial(self._load, name))
        rospy.loginfo("Controller Spawner: Loaded controllers: %s", ", ".join(self._loaded))
        if not stopped:
            self._in_turn(self._start)
        rospy.spin()

    def _in_turn(self, action: Callable[[], None]) -> None:
        with self._turn:
            if self._leaving:
                raise rospy.ROSInterruptException("shut down")
            action()

    def _load(self, name: str) -> None:
        rospy.loginfo("Loading controller: %s", name)
        try:
            if self._manager.load(name):
                self._loaded.append(name)
            else:
                rospy.logerr("Failed to load %s", name)
        except ServiceFailed as fault:
            rospy.logerr("Failed to load %s: %s", name, fault)

    def _start(self) -> None:
        names = ", ".join(self._loaded)
        try:
            if self._manager.switch(self._loaded, [], STRICT):
                rospy.loginfo("Started controllers: %s", names)
            else:
                rospy.logerr("Failed to start controllers: %s", names)
        except ServiceFailed as fault:
            rospy.logerr("Failed to start controllers: %s: %s", names, fault)

    def _leave(self) -> None:
        """Stops the running ones of our controllers and unloads all, last one first."""
        self._leaving = True
        # A call in progress may load one more; the wait for it has a bound.
        if self._turn.acquire(timeout=FAREWELL):
            self._turn.release()
        if not self._loaded:
            return
        rospy.loginfo("Shutting down spawner. Stopping and unloading controllers...")
        try:
            rospy.loginfo("Stopping all controllers...")
            # Someone else may have stopped one: a strict request that names it would stop none.
            running = [name for name in self._manager.running(FAREWELL) if name in self._loaded]
            self._manager.switch([], running, STRICT, FAREWELL)
            rospy.loginfo("Unloading all loaded controllers...")
            for name in reversed(self._loaded):
                rospy.loginfo("Trying to unload %s", name)
                if self._manager.unload(name, FAREWELL):
                    rospy.loginfo("Succeeded in unloading %s", name)
                else:
                    rospy.logerr("Failed to unload %s", name)
        except ServiceGone:  # roslaunch ends the simulator at the same time
            rospy.loginfo("The controller manager has ended, and its controllers with it")
        except ServiceFailed as fault:
            rospy.logwarn("Controller Spawner error while taking down controllers: %s", fault)


def unspawner_main(argv: Sequence[str] | None = None) -> int:
    """Runs unspawner; returns its exit code: 0, or 1 if no controller manager was found."""
    parser = argparse.ArgumentParser(prog="unspawner", description="Keep controllers stopped")
    parser.add_argument("controllers", nargs="+", help="their names")
    command_line = list(sys.argv if argv is None else argv)
    controllers = parser.parse_args(rospy.myargv(command_line)[1:]).controllers

    def work() -> int:
        init_node("unspawner", command_line)
        manager = ManagerClient(user="Unspawner")
        missing = manager.wait(("switch_controller", "list_controllers"), MANAGER_PATIENCE)
        if missing:
            rospy.logwarn("Unspawner couldn't find the controller manager: no service %s", missing)
            return 1
        _inhibit(manager, controllers)
        return 0

    return SignalHandler().run(work, interrupted=0)


def _inhibit(manager: ManagerClient, controllers: Sequence[str]) -> None:
    stopped: list[str] = []
    leaving = threading.Event()
    turn = threading.Lock()  # held while the manager does something for us

    def leave() -> None:
        leaving.set()
        # A call in progress may stop one more; the wait for it has a bound.
        if turn.acquire(timeout=FAREWELL):
            turn.release()
        _release(manager, stopped)

    rospy.on_shutdown(leave)
    while True:
        with turn:
            if leaving.is_set():
                break
            for name in _stop_running(manager, controllers):
                if name not in stopped:
                    stopped.append(name)
        leaving.wait(PERIOD)
    # After `rosnode kill`, leave() runs in another thread: the process must outlive it.
    rospy.spin()


def _stop_running(manager: ManagerClient, controllers: Sequence[str]) -> list[str]:
    """Stops the running ones among `controllers`; returns their names."""
    try:
        running = [name for name in manager.running(ANSWER) if name in controllers]
        if running and manager.switch([], running, BEST_EFFORT, ANSWER):
            rospy.loginfo("Stopped controllers: %s", ", ".join(running))
            return running
    except ServiceFailed as fault:
        rospy.logwarn_throttle(30, f"Unspawner: {fault}")
    return []


def _release(manager: ManagerClient, stopped: Sequence[str]) -> None:
    if not stopped:
        return
    try:
        manager.switch(stopped, [], BEST_EFFORT, FAREWELL)
        rospy.loginfo("Started controllers: %s", ", ".join(stopped))
    except ServiceFailed as fault:
        rospy.loginfo("Unspawner: left as they are: %s", fault)
