"""The commands `controller_manager` and `controller_group` (docs/contract/ros_control.md 2).

They end with 0, even if the manager refused; with 1 if there is no manager or no such group; with 2 for a
wrong command line.
"""

import argparse
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

MANAGER_HELP = "The manager is the one in this program's namespace; another one: __ns:=/NAMESPACE"
GROUP_HELP = f"""\
Groups are in the parameter controller_groups: {{GROUP: [NAME, ...], ...}}; they may share controllers, and a
controller in no group is left alone. {MANAGER_HELP}"""
PARAMETER = "controller_groups"
LAST = "controller_manager/reload_controller_libraries"  # of a manager's services to come up
MANAGER_PATIENCE = 30.0  # [s]; launch files start scripts before there is a manager
NOTICE = 2.0  # [s] until the command prints which service it waits for

Groups = dict[str, list[str]]


class CommandFailed(Exception):
    """There is no master, no manager, or no such group; the text says which."""


SPAWN = (load_controller, start_controller)
ON_CONTROLLERS: dict[str, tuple[Sequence[Callable[[str], bool]], list[str], str]] = {
    # command: what is done to all controllers, one after the other; another name of it; what it is
    "load": ([load_controller], [], "load"),
    "unload": ([unload_controller], [], "unload"),
    "start": ([start_controller], [], "start"),
    "stop": ([stop_controller], [], "stop"),
    "spawn": (SPAWN, ["sp"], "load, then start"),
    "kill": ([stop_controller, unload_controller], ["kl"], "stop, then unload"),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Runs `controller_manager`; returns its exit code."""
    parser = argparse.ArgumentParser(prog="controller_manager", epilog=MANAGER_HELP)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name, (steps, others, text) in ON_CONTROLLERS.items():
        command = commands.add_parser(name, aliases=others, help=text)
        command.add_argument("names", nargs="+", metavar="NAME", help="name of a controller")
        command.set_defaults(act=lambda options, steps=steps: _on_controllers(steps, options.names))
    command = commands.add_parser("list", aliases=["lc"], help="the loaded controllers")
    command.set_defaults(act=lambda _: list_controllers())
    command = commands.add_parser("list-types", aliases=["lt"], help="types that can be loaded")
    command.set_defaults(act=lambda _: list_controller_types())
    text = "stop and unload all controllers, then look for controller types again"
    command = commands.add_parser("reload-libraries", help=text)
    command.add_argument("--restore", action="store_true", help="load and start them again")
    command.set_defaults(act=lambda options: reload_libraries(True, restore=options.restore))
    options = parser.parse_args(rospy.myargv(list(sys.argv if argv is None else argv))[1:])

    def act() -> None:
        _require_manager()
        options.act(options)

    return _run("controller_manager", act)


def group_main(argv: Sequence[str] | None = None) -> int:
    """Runs `controller_group`; returns its exit code."""
    parser = argparse.ArgumentParser(prog="controller_group", epilog=GROUP_HELP)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    command = commands.add_parser("list", help="the groups and their controllers")
    command.set_defaults(act=lambda _: _list_groups(_read_groups()))
    command = commands.add_parser("spawn", help="load and start the controllers of a group")
    command.set_defaults(act=lambda options: _spawn(_read_groups(), options.group))
    command.add_argument("group", metavar="GROUP")
    text = "stop the other groups' running controllers, and start those of a group, loaded if need be"
    command = commands.add_parser("switch", help=text)
    command.set_defaults(act=lambda options: _switch_to(_read_groups(), options.group))
    command.add_argument("group", metavar="GROUP")
    options = parser.parse_args(rospy.myargv(list(sys.argv if argv is None else argv))[1:])
    return _run("controller_group", lambda: options.act(options))


def _run(name: str, act: Callable[[], object]) -> int:
    try:
        act()
    except (CommandFailed, rospy.ROSException, rospy.ServiceException, OSError) as fault:
        print(f"{name}: {fault}", file=sys.stderr)
        return 1
    return 0


def _on_controllers(steps: Sequence[Callable[[str], bool]], names: Sequence[str]) -> None:
    for step in steps:
        for name in names:
            step(name)


def _require_master() -> None:
    if not master.is_up():
        raise CommandFailed(f"there is no ROS master at {master.uri()}")


def _require_manager() -> None:
    """Waits for the manager in the program's namespace."""
    _require_master()
    name = str(rospy.resolve_name(LAST))
    if service_comes_up(name, NOTICE):
        return
    print(f"waiting up to {MANAGER_PATIENCE:g} s for the service {name}", file=sys.stderr)
    if not service_comes_up(name, MANAGER_PATIENCE - NOTICE):
        raise CommandFailed(
            f"there is no controller manager: no node offers the service {name}. Is the robot"
            " spawned, and is its manager in this namespace? (Another one: __ns:=/NAMESPACE)"
        )


def _read_groups() -> Groups:
    _require_master()
    groups = rospy.get_param(PARAMETER, None)
    place = f"the parameter {rospy.resolve_name(PARAMETER)}"
    if groups is None:
        raise CommandFailed(f"{place} isn't set")
    if not isinstance(groups, dict):
        raise CommandFailed(f"{place} must map names of groups to lists of controllers")
    for group, names in groups.items():
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise CommandFailed(f"{place}: group '{group}' must be a list of names of controllers")
    return {str(group): names for group, names in groups.items()}


def _group(groups: Groups, name: str) -> list[str]:
    if name not in groups:
        raise CommandFailed(f"no group '{name}' in {rospy.resolve_name(PARAMETER)}: {sorted(groups)}")
    return groups[name]


def _list_groups(groups: Groups) -> None:
    print(f"Number of groups: {len(groups)}")
    for group in sorted(groups):
        print(f"  {group}")
        for name in groups[group]:
            print(f"      {name}")


def _spawn(groups: Groups, group: str) -> None:
    names = _group(groups, group)
    _require_manager()
    _on_controllers(SPAWN, names)


def _switch_to(groups: Groups, group: str) -> None:
    wanted = _group(groups, group)
    _require_manager()
    states = {each.name: each.state for each in loaded_controllers()}
    for name in wanted:
        if name not in states:
            load_controller(name)
    start = [name for name in wanted if states.get(name) != "running"]
    grouped = {name for names in groups.values() for name in names}
    stop = [
        name
        for name, state in states.items()
        if state == "running" and name in grouped and name not in wanted
    ]
    if start or stop:
        switch_controllers(start, stop)
