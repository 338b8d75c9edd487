"""The commands `controller_manager` and `controller_group` (docs/contract/ros_control.md 2).

They end with 0, even if the manager refused; with 1 if there is no manager or no such group; with 2 for a
wrong command line.
"""

import sys
from collections.abc import Callable, Sequence

import rospy
from controller_manager.controller_manager_interface import (
    list_controller_types,
    list_controllers,
    load_controller,
    loaded_controllers,
    reload_libraries,
    start_controller,
    stop_controller,
    switch_controllers,
    unload_controller,
)

from ros_calls import master
from ros_calls.waiting import service_comes_up

MANAGER_USAGE = """\
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
GROUP_USAGE = """\
usage: controller_group COMMAND

commands:
    list            the groups and their controllers
    spawn GROUP     load and start the controllers of a group
    switch GROUP    stop the running controllers of the other groups, and start those of this one;
                    controllers that aren't loaded are loaded first

Groups are in the parameter controller_groups: {GROUP: [NAME, ...], ...}; they may share controllers, and a
controller in no group is left alone.
The manager is the one in this program's namespace; another one: __ns:=/NAMESPACE"""
HELP = ("-h", "--help")
SAME = {"sp": "spawn", "kl": "kill", "lc": "list", "lt": "list-types"}
PARAMETER = "controller_groups"
LAST = "controller_manager/reload_controller_libraries"  # of a manager's services to come up
PATIENCE = 30.0  # [s]; launch files start scripts before there is a manager
NOTICE = 2.0  # [s] until the command prints which service it waits for

Groups = dict[str, list[str]]


class CommandFailed(Exception):
    """There is no master, no manager, or no such group; the text says which."""


ON_CONTROLLERS: dict[str, tuple[Callable[[str], bool], ...]] = {
    "load": (load_controller,),
    "unload": (unload_controller,),
    "start": (start_controller,),
    "stop": (stop_controller,),
    "spawn": (load_controller, start_controller),
    "kill": (stop_controller, unload_controller),
}
ON_MANAGER: dict[tuple[str, ...], Callable[[], object]] = {
    ("list",): list_controllers,
    ("list-types",): list_controller_types,
    ("reload-libraries",): lambda: reload_libraries(force_kill=True),
    ("reload-libraries", "--restore"): lambda: reload_libraries(force_kill=True, restore=True),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Runs `controller_manager`; returns its exit code."""
    arguments = rospy.myargv(list(sys.argv if argv is None else argv))[1:]
    command, *names = arguments or [""]
    command = SAME.get(command, command)
    if command in ON_CONTROLLERS and names:
        steps = ON_CONTROLLERS[command]
        return _run("controller_manager", lambda: _on_controllers(steps, names))
    if (command, *names) in ON_MANAGER:
        return _run("controller_manager", lambda: _on_manager(ON_MANAGER[command, *names]))
    print(MANAGER_USAGE)
    return 0 if command in HELP else 2


def group_main(argv: Sequence[str] | None = None) -> int:
    """Runs `controller_group`; returns its exit code."""
    arguments = rospy.myargv(list(sys.argv if argv is None else argv))[1:]
    match arguments:
        case ["list"]:
            return _run("controller_group", lambda: _list_groups(_read_groups()))
        case ["spawn", group]:
            steps = ON_CONTROLLERS["spawn"]
            return _run("controller_group", lambda: _on_controllers(steps, _group(group)))
        case ["switch", group]:
            return _run("controller_group", lambda: _switch_to(_group(group)))
    print(GROUP_USAGE)
    return 0 if arguments and arguments[0] in HELP else 2


def _run(name: str, act: Callable[[], object]) -> int:
    try:
        act()
    except (CommandFailed, rospy.ROSException, rospy.ServiceException, OSError) as fault:
        print(f"{name}: {fault}", file=sys.stderr)
        return 1
    return 0


def _on_manager(act: Callable[[], object]) -> None:
    _require_manager()
    act()


def _on_controllers(steps: Sequence[Callable[[str], bool]], names: Sequence[str]) -> None:
    _require_manager()
    for step in steps:
        for name in names:
            step(name)


def _require_master() -> None:
    if not master.is_up():
        raise CommandFailed(f"there is no ROS master at {master.uri()}")


def _require_manager() -> None:
    """Waits for the manager in the program's namespace.

    Raises:
        CommandFailed: it doesn't come up in time.
    """
    _require_master()
    name = str(rospy.resolve_name(LAST))
    if service_comes_up(name, NOTICE):
        return
    print(f"waiting up to {PATIENCE:g} s for the service {name}", file=sys.stderr)
    if not service_comes_up(name, PATIENCE - NOTICE):
        raise CommandFailed(
            f"there is no controller manager: nobody offers the service {name}. Is the robot"
            " spawned, and is its manager in this namespace? (Another one: __ns:=/NAMESPACE)"
        )


def _read_groups() -> Groups:
    _require_master()
    found = rospy.get_param(PARAMETER, None)
    place = f"the parameter {rospy.resolve_name(PARAMETER)}"
    if found is None:
        raise CommandFailed(f"{place} isn't set")
    if not isinstance(found, dict):
        raise CommandFailed(f"{place} must map names of groups to lists of controllers")
    for group, names in found.items():
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise CommandFailed(f"{place}: group '{group}' must be a list of names of controllers")
    return {str(group): names for group, names in found.items()}


def _group(name: str) -> list[str]:
    groups = _read_groups()
    if name not in groups:
        raise CommandFailed(
            f"no group '{name}' in {rospy.resolve_name(PARAMETER)}: {sorted(groups)}"
        )
    return groups[name]


def _list_groups(groups: Groups) -> None:
    print(f"Number of groups: {len(groups)}")
    for group in sorted(groups):
        print(f"  {group}")
        for name in groups[group]:
            print(f"      {name}")


def _switch_to(wanted: Sequence[str]) -> None:
    _require_manager()
    states = {each.name: each.state for each in loaded_controllers()}
    for name in wanted:
        if name not in states:
            load_controller(name)
    start = [name for name in wanted if states.get(name) != "running"]
    grouped = {name for names in _read_groups().values() for name in names}
    stop = [
        name
        for name, state in states.items()
        if state == "running" and name in grouped and name not in wanted
    ]
    if start or stop:
        switch_controllers(start, stop)
