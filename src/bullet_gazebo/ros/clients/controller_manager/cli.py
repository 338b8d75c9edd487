"""Executable `controller_manager` of package controller_manager (docs/contract/ros_control.md 2)."""

import sys
from collections.abc import Callable, Sequence
from typing import NamedTuple

import rospy

from bullet_gazebo.ros.clients.controller_manager import interface
from bullet_gazebo.ros.clients.controller_manager.presence import NoManager, require

USAGE = """\
usage: controller_manager COMMAND [NAME...]

commands on controllers, one or more:
    load NAME...            load
    unload NAME...          unload
    start NAME...           start
    stop NAME...            stop
    spawn NAME... (sp)      load, then start
    kill NAME... (kl)       stop, then unload

commands on the controller manager:
    list (lc)               names, hardware interfaces and states of the loaded controllers
    list-types (lt)         types that can be loaded
    reload-libraries [--restore]
                            stop and unload all controllers, and look for types anew;
                            with --restore load and start them again

The manager is the one in this program's namespace; another one: __ns:=/NAMESPACE"""

HELP = ("-h", "--help")
SAME = {"sp": "spawn", "kl": "kill", "lc": "list", "lt": "list-types"}


class _OnControllers(NamedTuple):
    services: tuple[str, ...]
    steps: tuple[Callable[[str], bool], ...]


ON_CONTROLLERS = {
    "load": _OnControllers(("load_controller",), (interface.load_controller,)),
    "unload": _OnControllers(("unload_controller",), (interface.unload_controller,)),
    "start": _OnControllers(("switch_controller",), (interface.start_controller,)),
    "stop": _OnControllers(("switch_controller",), (interface.stop_controller,)),
    "spawn": _OnControllers(
        ("load_controller", "switch_controller"),
        (interface.load_controller, interface.start_controller),
    ),
    "kill": _OnControllers(
        ("switch_controller", "unload_controller"),
        (interface.stop_controller, interface.unload_controller),
    ),
}
RELOADING = (
    "reload_controller_libraries",
    "list_controllers",
    "load_controller",
    "switch_controller",
)


def main(argv: Sequence[str] | None = None) -> int:
    """Carries out one command.

    Returns:
        The exit code: 0, also if the manager refused, which is printed; 1 if there is no manager;
        2 for a wrong command line.
    """
    arguments = rospy.myargv(list(sys.argv if argv is None else argv))[1:]
    action = _action(arguments)
    if action is None:
        print(USAGE)
        return 0 if arguments and arguments[0] in HELP else 2
    try:
        action()
    except (NoManager, rospy.ROSException, rospy.ServiceException, OSError) as fault:
        print(f"controller_manager: {fault}", file=sys.stderr)
        return 1
    return 0


def _action(arguments: Sequence[str]) -> Callable[[], None] | None:
    """Returns what a command line asks for; None if it is none."""
    if not arguments:
        return None
    command, *rest = arguments
    command = SAME.get(command, command)
    if command in ON_CONTROLLERS and rest:
        return lambda: _on_controllers(ON_CONTROLLERS[command], rest)
    if command == "list" and not rest:
        return _list
    if command == "list-types" and not rest:
        return _list_types
    if command == "reload-libraries" and rest in ([], ["--restore"]):
        return lambda: _reload(bool(rest))
    return None


def _on_controllers(command: _OnControllers, names: Sequence[str]) -> None:
    require(command.services)
    for step in command.steps:
        for name in names:
            step(name)


def _list() -> None:
    require(("list_controllers",))
    interface.list_controllers()


def _list_types() -> None:
    require(("list_controller_types",))
    interface.list_controller_types()


def _reload(restore: bool) -> None:
    require(RELOADING)
    interface.reload_libraries(force_kill=True, restore=restore)
