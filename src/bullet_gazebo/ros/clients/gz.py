"""Executable `gz`: Gazebo's command line tool, as far as it concerns the world.

See docs/contract/gazebo_launch.md 5.1.

``gz world -p 1|0`` pauses and goes on, ``-s`` does one step, ``-m N`` does N, ``-r`` resets time and
models, ``-t`` the time, ``-o`` the models.
"""

import argparse
import sys
from collections.abc import Sequence

import rosgraph

from bullet_gazebo.ros.clients.world_client import ControlFailed, RemoteWorld

NODE = "gazebo"


def main(argv: Sequence[str] | None = None) -> int:
    """Carries out one command; returns the exit code: 0, 1 if it failed, 2 for a wrong command line."""
    options = _parse(rosgraph.myargv(sys.argv if argv is None else list(argv))[1:])
    node = rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), options.node)
    try:
        _carry_out(RemoteWorld(node, rosgraph.get_master_uri()), options)
    except ControlFailed as error:
        print(f"gz world: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gz", description="Steer a running simulator.")
    world = parser.add_subparsers(dest="tool", required=True).add_parser(
        "world", help="pause, step and reset the world"
    )
    world.add_argument("-w", "--world-name", help="accepted: a simulator has one world")
    world.add_argument("--node", default=NODE, help="the simulator's node (default: %(default)s)")
    what = world.add_mutually_exclusive_group(required=True)
    what.add_argument("-p", "--pause", choices=("0", "1"), help="1 stops the time, 0 lets it go on")
    what.add_argument("-s", "--step", action="store_true", help="pause and do one step")
    what.add_argument("-m", "--multi-step", type=_count, metavar="N", help="pause and do N steps")
    what.add_argument("-r", "--reset-all", action="store_true", help="reset time and models")
    what.add_argument("-t", "--reset-time", action="store_true", help="reset the time")
    what.add_argument("-o", "--reset-models", action="store_true", help="reset the models' poses")
    return parser.parse_args(arguments)


def _count(text: str) -> int:
    count = int(text)
    if count < 1:
        raise argparse.ArgumentTypeError(f"{count}: at least 1 step")
    return count


def _carry_out(world: RemoteWorld, options: argparse.Namespace) -> None:
    if options.multi_step or options.step:
        world.step(options.multi_step or 1)
    elif options.pause is not None:
        world.command("pause" if options.pause == "1" else "unpause")
    elif options.reset_all:
        world.command("reset")
    else:
        world.command("reset_time" if options.reset_time else "reset_models")
