"""The commands `controller_manager` and `controller_group` (docs/contract/ros_control.md 2).

Both print what the manager did. They end with 0, even if it refused; with 1 if there is no manager or no such
group; with 2 for a wrong command line.
"""

import sys
from collections.abc import Callable, Iterable, Sequence

import rospy

from bullet_gazebo.ros.clients import manager_interface as manager
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

Step = tuple[str, Callable[[str], bool]]
LOAD: Step = ("load_controller", manager.load_controller)
UNLOAD: Step = ("unload_controller", manager.unload_controller)
START: Step = ("switch_controller", manager.start_controller)
STOP: Step = ("switch_controller", manager.stop_controller)
ON_CONTROLLERS = {  # command: service and function of each of its steps
    "load": [LOAD],
    "unload": [UNLOAD],
    "start": [START],
    "stop": [STOP],
    "spawn": [LOAD, START],
    "kill": [STOP, UNLOAD],
}
ON_MANAGER: dict[tuple[str, ...], tuple[list[str], Callable[[], object]]] = {
    ("list",): (["list_controllers"], manager.list_controllers),
    ("list-types",): (["list_controller_types"], manager.list_controller_types),
    ("reload-libraries",): (
        ["reload_controller_libraries"],
        lambda: manager.reload_libraries(force_kill=True),
    ),
    ("reload-libraries", "--restore"): (
        ["reload_controller_libraries", "list_controllers", "load_controller", "switch_controller"],
        lambda: manager.reload_libraries(force_kill=True, restore=True),
    ),
}
PARAMETER = "controller_groups"
PATIENCE = 30.0  # [s] for each service; launch files start scripts before there is a manager
NOTICE = 2.0  # [s] until the command prints which service it waits for

Groups = dict[str, list[str]]


class CommandFailed(Exception):
    """There is no master, no manager, or no such group; the text says which."""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs `controller_manager`; returns its exit code."""
    arguments = rospy.myargv(list(sys.argv if argv is None else argv))[1:]
    command, *rest = arguments or [""]
    command = SAME.get(command, command)
    if command in ON_CONTROLLERS and rest:
        steps = ON_CONTROLLERS[command]
        return _run("controller_manager", lambda: _on_controllers(steps, rest))
    if (command, *rest) in ON_MANAGER:
        services, act = ON_MANAGER[command, *rest]
        return _run("controller_manager", lambda: _on_manager(services, act))
    print(MANAGER_USAGE)
    return 0 if command in HELP else 2


def group_main(argv: Sequence[str] | None = None) -> int:
    """Runs `controller_group`; returns its exit code."""
    arguments = rospy.myargv(list(sys.argv if argv is None else argv))[1:]
    match arguments:
        case ["list"]:
            return _run("controller_group", lambda: _list_groups(_read_groups()))
        case ["spawn", group]:
            return _run("controller_group", lambda: _on_controllers([LOAD, START], _group(group)))
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


def _on_manager(services: Sequence[str], act: Callable[[], object]) -> None:
    _require(services)
    act()


def _on_controllers(steps: Sequence[Step], names: Sequence[str]) -> None:
    _require(service for service, _ in steps)
    for _, step in steps:
        for name in names:
            step(name)


def _require(services: Iterable[str]) -> None:
    """Waits until services of the manager in the program's namespace are offered.

    Raises:
        CommandFailed: one of them isn't there in time.
    """
    if not master.is_up():
        raise CommandFailed(f"there is no ROS master at {master.uri()}")
    for service in services:
        name = str(rospy.resolve_name(f"controller_manager/{service}"))
        if service_comes_up(name, NOTICE):
            continue
        print(f"waiting up to {PATIENCE:g} s for the service {name}", file=sys.stderr)
        if not service_comes_up(name, PATIENCE - NOTICE):
            raise CommandFailed(
                f"there is no controller manager: nobody offers the service {name}. Is the robot"
                " spawned, and is its manager in this namespace? (Another one: __ns:=/NAMESPACE)"
            )


def _read_groups() -> Groups:
    _require(())  # just the master, for its parameters
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
    _require(("list_controllers", "load_controller", "switch_controller"))
    states = {each.name: each.state for each in manager.loaded_controllers()}
    for name in wanted:
        if name not in states:
            manager.load_controller(name)
    start = [name for name in wanted if states.get(name) != "running"]
    grouped = {name for names in _read_groups().values() for name in names}
    stop = [
        name
        for name, state in states.items()
        if state == "running" and name in grouped and name not in wanted
    ]
    if start or stop:
        manager.switch_controllers(start, stop)
