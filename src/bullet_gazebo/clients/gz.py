"""The command `gz world`, and the client behind it (docs/contract/gazebo_launch.md 5.1).

``gz world -p 1|0`` pauses and resumes, ``-s`` does one step, ``-m N`` does N, ``-r`` resets time and
models, ``-t`` the time, ``-o`` the models. It imports no rospy, so that it starts at once.
"""

import argparse
import sys
from collections.abc import Sequence

import rosgraph

from ros_calls import master

NODE = "gazebo"
METHOD = "gazeboWorld"  # of the node's XML-RPC server; `world_services.WorldControl` answers it
CHUNK = 1000  # steps in one call, so that an interrupted client stops soon
CALL_TIMEOUT = 60.0  # [s] for one call
INSTEAD = {  # of Gazebo's other tools
    "camera": "gzclient's page follows a model that is chosen",
    "joint": "rosservice call /gazebo/apply_joint_effort, or a controller of controller_manager",
    "log": "rosbag record, or gzserver --video FILE",
    "model": "rosrun gazebo_ros spawn_model; rosservice call /gazebo/get_model_state, "
    "/gazebo/set_model_state and /gazebo/delete_model",
    "physics": "rosservice call /gazebo/get_physics_properties and /gazebo/set_physics_properties",
    "sdf": "rosrun gazebo_ros spawn_model, which reads URDF and SDF and says what is wrong",
    "stats": "rosservice call /gazebo/get_world_properties; gzclient's page shows the real-time factor",
    "topic": "rostopic list, and rostopic echo /gazebo/model_states",
}


class ControlFailed(Exception):
    """The simulator can't be reached, or refuses; the text says which."""


class RemoteWorld:
    """A running simulator, by its node's name. Without it or its answer: ControlFailed."""

    def __init__(self, node: str, master_uri: str) -> None:
        """`node` is the simulator's full name, usually /gazebo."""
        self._node = node
        try:
            self._address = str(master.call_node(master_uri, "lookupNode", node))
        except master.NoAnswer as fault:
            raise ControlFailed(f"no ROS master at {master_uri}: {fault}") from fault
        except master.Refused as fault:
            raise ControlFailed(
                f"no node {node} at the master {master_uri}: is a simulator running?"
            ) from fault

    def command(self, name: str, count: int = 1) -> None:
        """Runs one command: pause, unpause, step, reset, reset_models, reset_time, show or end_journal."""
        try:
            master.call_node(self._address, METHOD, name, count, timeout=CALL_TIMEOUT)
        except master.Refused as fault:
            raise ControlFailed(f"{self._node}: {fault}") from fault
        except master.BadAnswer as fault:
            raise ControlFailed(f"{self._node} doesn't know {METHOD}: {fault}") from fault
        except master.NoAnswer as fault:
            raise ControlFailed(f"{self._node} doesn't answer: {fault}") from fault

    def step(self, ticks: int) -> None:
        """Pauses the world, and returns after `ticks` steps."""
        while ticks > 0:
            count = min(ticks, CHUNK)
            self.command("step", count)
            ticks -= count


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit code: 0, 1 if it failed, 2 for a wrong command line."""
    arguments = rosgraph.myargv(sys.argv if argv is None else list(argv))[1:]
    if arguments and arguments[0] in INSTEAD:
        print(f"gz: there is no 'gz {arguments[0]}': {INSTEAD[arguments[0]]}", file=sys.stderr)
        return 2
    options = _parse(arguments)
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
    parser = argparse.ArgumentParser(prog="gz", description="Control a running simulator.")
    world = parser.add_subparsers(dest="tool", required=True).add_parser(
        "world", help="pause, step and reset the world"
    )
    world.add_argument("-w", "--world-name", help="accepted: a simulator has one world")
    world.add_argument("--node", default=NODE, help="the simulator's node (default: %(default)s)")
    what = world.add_mutually_exclusive_group(required=True)
    what.add_argument("-p", "--pause", choices=("0", "1"), help="1 pauses the world, 0 resumes it")
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
