"""Executable `unspawner` of package controller_manager: keeps controllers stopped while it runs.

It stops the named controllers, again whenever somebody starts them, and starts those that it has
stopped when it is shut down (docs/contract/ros_control.md 2).
"""

import argparse
import sys
import threading
from collections.abc import Sequence

import rospy

from bullet_gazebo.ros.clients.controller_manager.client import BEST_EFFORT, ManagerClient
from bullet_gazebo.ros.wire.signals import SignalHandler, init_node
from ros_calls.service import ServiceFailed

PERIOD = 3.0  # [s], wall-clock: a simulated time that jumps back must not silence it
PATIENCE = 30.0  # [s] for the services to come up
ANSWER = 10.0  # [s] for one call
FAREWELL = 3.0  # [s] for the call during shutdown; the simulator may have gone before us


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the unspawner until its node is shut down.

    Returns:
        The exit code: 0, or 1 if no controller manager was found.
    """
    parser = argparse.ArgumentParser(prog="unspawner", description="Keep controllers stopped")
    parser.add_argument("controllers", nargs="+", help="their names")
    command_line = list(sys.argv if argv is None else argv)
    controllers = parser.parse_args(rospy.myargv(command_line)[1:]).controllers

    def work() -> int:
        init_node("unspawner", command_line)
        manager = ManagerClient(user="Unspawner")
        missing = manager.wait(("switch_controller", "list_controllers"), PATIENCE)
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
        # A call that is under way may stop one more. It isn't waited for for ever.
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
    # A shutdown that `rosnode kill` asks for runs leave() beside us: the process must outlive it.
    rospy.spin()


def _stop_running(manager: ManagerClient, controllers: Sequence[str]) -> list[str]:
    """Returns the names of those that ran and were stopped."""
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
