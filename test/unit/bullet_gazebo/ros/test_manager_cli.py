"""The command lines of controller_manager and controller_group, as far as they need no ROS."""

import pytest

from bullet_gazebo.ros.clients.controller_manager import cli as manager_cli
from bullet_gazebo.ros.clients.controller_manager import group_cli

MANAGER = ["", "spin cart", "load", "unload", "start", "stop", "spawn", "sp", "kill", "kl", "list cart",
           "lc cart", "list-types x", "lt x", "--list", "reload-libraries --revert",
           "reload-libraries --restore now"]  # fmt: skip
GROUP = ["", "list upper", "spawn", "switch", "switch upper lower", "stop upper", "--list"]
HELP = ["-h", "--help"]


@pytest.mark.parametrize(
    ("cli", "name", "line"),
    [(manager_cli, "controller_manager", line) for line in MANAGER + HELP]
    + [(group_cli, "controller_group", line) for line in GROUP + HELP],
)
def test_what_is_no_command_is_answered_with_the_usage(cli, name, line, capsys):
    # What roslaunch adds to each command line is no argument.
    code = cli.main([name, *line.split(), "__name:=node", "__log:=file"])
    output, errors = capsys.readouterr()
    assert output == f"{cli.USAGE}\n"
    assert errors == ""
    assert output.startswith(f"usage: {name} COMMAND")
    assert code == (0 if line in HELP else 2)


def test_the_usage_names_all_commands():
    for command in (*manager_cli.ON_CONTROLLERS, *manager_cli.SAME, *manager_cli.SAME.values()):
        assert command in manager_cli.USAGE
