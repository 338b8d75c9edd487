"""Executable `controller_group` of package controller_manager (docs/contract/ros_control.md 2).

The parameter `controller_groups` maps the names of groups to lists of controllers. Groups may share
controllers; a controller that is in no group is left alone.
"""

import sys
from collections.abc import Sequence

import rospy

from bullet_gazebo.ros.clients.controller_manager import interface
from bullet_gazebo.ros.clients.controller_manager.presence import NoManager, require

PARAMETER = "controller_groups"
USAGE = """\
usage: controller_group COMMAND

commands:
    list            the groups and their controllers
    spawn GROUP     load and start the controllers of a group
    switch GROUP    stop the running controllers of the other groups, and start those of this one;
                    what isn't loaded is loaded first

Groups are in the parameter controller_groups: {GROUP: [NAME, ...], ...}
The manager is the one in this program's namespace; another one: __ns:=/NAMESPACE"""
HELP = ("-h", "--help")

Groups = dict[str, list[str]]


class BadGroups(Exception):
    """The parameter is missing or has the wrong form, or there is no such group."""


def main(argv: Sequence[str] | None = None) -> int:
    """Carries out one command.

    Returns:
        The exit code: 0, also if the manager refused, which is printed; 1 if there is no manager or
        no such group; 2 for a wrong command line.
    """
    arguments = rospy.myargv(list(sys.argv if argv is None else argv))[1:]
    if not _is_command(arguments):
        print(USAGE)
        return 0 if arguments and arguments[0] in HELP else 2
    try:
        _carry_out(*arguments)
    except (BadGroups, NoManager, rospy.ROSException, rospy.ServiceException, OSError) as fault:
        print(f"controller_group: {fault}", file=sys.stderr)
        return 1
    return 0


def _is_command(arguments: Sequence[str]) -> bool:
    return list(arguments) == ["list"] or (
        len(arguments) == 2 and arguments[0] in ("spawn", "switch")
    )


def _carry_out(command: str, group: str = "") -> None:
    require(())  # a master, which knows the parameters
    groups = _read_groups()
    if command == "list":
        _list(groups)
        return
    if group not in groups:
        raise BadGroups(f"no group '{group}' in {rospy.resolve_name(PARAMETER)}: {sorted(groups)}")
    require(("list_controllers", "load_controller", "switch_controller"))
    if command == "spawn":
        _spawn(groups[group])
    else:
        _switch(groups, group)


def _read_groups() -> Groups:
    found = rospy.get_param(PARAMETER, None)
    place = f"the parameter {rospy.resolve_name(PARAMETER)}"
    if found is None:
        raise BadGroups(f"{place} isn't set")
    if not isinstance(found, dict):
        raise BadGroups(f"{place} must map names of groups to lists of controllers")
    for group, names in found.items():
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise BadGroups(f"{place}: group '{group}' must be a list of names of controllers")
    return {str(group): names for group, names in found.items()}


def _list(groups: Groups) -> None:
    print(f"Number of groups: {len(groups)}")
    for group in sorted(groups):
        print(f"  {group}")
        for name in groups[group]:
            print(f"      {name}")


def _spawn(names: Sequence[str]) -> None:
    for step in (interface.load_controller, interface.start_controller):
        for name in names:
            step(name)


def _switch(groups: Groups, group: str) -> None:
    wanted = groups[group]
    states = {each.name: each.state for each in interface.loaded_controllers()}
    for name in wanted:
        if name not in states:
            interface.load_controller(name)
    start = [name for name in wanted if states.get(name) != "running"]
    grouped = {name for names in groups.values() for name in names}
    stop = [
        name
        for name, state in states.items()
        if state == "running" and name in grouped and name not in wanted
    ]
    if start or stop:
        interface.switch_controllers(start, stop)
