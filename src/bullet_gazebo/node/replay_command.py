"""The command line of `replay.py`: a master, the simulator and the replay in one process (docs/replay.md)."""

import argparse
import contextlib
import logging
import math
import os
import sys
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path

import rosparam
import rospy
from rosmaster.master import Master

from bullet_gazebo.journal.recorded import NoRecording, RecordedJournal
from bullet_gazebo.node import gzserver
from bullet_gazebo.node.replay import Changes, Replay
from bullet_gazebo.node.start import HASHES, arguments_of, check_facts
from file_access.expansion import CannotExpand, expand
from file_access.text import one_line
from ros_calls.waiting import wait_until

UNUSABLE = 2
WINDOW = 60.0  # [s of wall time] for the page to open
LOOPBACK = "127.0.0.1"


def main(argv: Sequence[str] | None = None) -> int:
    """Replays a bag; returns 0 if all was equal, 1 if something differs, 2 if it can't be replayed."""
    args = parse_args(argv)
    try:
        recorded = RecordedJournal(args.bag)
        _check(recorded, args.bag, args.trust)
        models = {name: expand(path) for name, path in args.model}
        parameters = [each for name, path in args.params for each in rosparam.load_file(str(path), name)]
        if models or parameters:
            ns_join = rospy.names.ns_join
            named = [{ns_join(space, each): values[each] for each in values} for values, space in parameters]
            recorded.check_changes(models, named)
    except (NoRecording, CannotExpand, rosparam.RosParamException, OSError) as fault:
        return _tell(str(fault), UNUSABLE)
    hashes = recorded.facts["hashes"]
    if hashes not in (None, os.environ.get(HASHES)):
        os.environ[HASHES] = hashes  # Python reads it at its start: run it again
        os.execv(sys.executable, [sys.executable, *sys.argv])
    master = Master(0)
    os.environ["ROS_IP"] = LOOPBACK
    os.environ.pop("ROS_HOSTNAME", None)
    master.start()
    os.environ["ROS_MASTER_URI"] = master.uri

    changes = Changes(models, parameters)
    try:
        with tempfile.TemporaryDirectory(prefix="replay-") as folder:
            return _replay(args, recorded, changes, Path(folder))
    finally:
        master.stop()


def parse_args(argv: Sequence[str] | None = None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="replay.py",
        description="Repeats a run that lockstep.py --record or rosbag has recorded, in a simulator of its"
        " own, and names the first difference.",
    )
    option = parser.add_argument
    option("bag", type=Path, help="the recorded run")
    option(
        "--until", type=float, default=math.inf, metavar="SECONDS",
        help="stop after the request with which that much simulated time has passed since the start",
    )  # fmt: skip
    option(
        "--trust", action="store_true",
        help="import the plugins and controllers that the bag names, beside those that come along",
    )  # fmt: skip
    option("--gui", action="store_true", help="open the simulator's page where the replay stops")
    option(
        "--from", type=float, default=math.inf, metavar="SECONDS", dest="shown_from",
        help="with --gui: open the page at that time, and repeat the rest at the speed of the run",
    )  # fmt: skip
    for flag, what, text in (
        ("--model", "NAME=FILE", "spawn this model from a URDF, xacro or SDF file"),
        ("--params", "NAMESPACE=FILE", "put parameters of a YAML file in place of those recorded"),
    ):
        option(
            flag, action="append", default=[], type=_pair, metavar=what,
            help=f"{text}; may be repeated",
        )  # fmt: skip
    return parser.parse_args(argv)


def _replay(args: argparse.Namespace, recorded: RecordedJournal, changes: Changes, folder: Path) -> int:
    """Runs the simulator in this thread and the replay in another one; returns the exit code."""
    changes.set_parameters(recorded.start)
    os.environ.pop(gzserver.MORE_ARGUMENTS, None)

    def work(node: gzserver.GazeboNode) -> int:
        over = threading.Event()
        rospy.on_shutdown(over.set)
        replay = Replay(recorded, node, changes, args.until)
        with contextlib.ExitStack() as page:
            if args.gui:
                replay.shown_from = args.shown_from
                replay.at_shown = lambda: _open(page, replay)
            try:
                replay.run()
            except NoRecording as fault:
                return _tell(str(fault), UNUSABLE)
            code = _judge(args.bag, replay, args.until)
            if args.gui and not over.is_set():
                if replay.shown_from == args.shown_from:
                    page.enter_context(gzserver.window([]))
                over.wait()
        return code

    # Warnings have been seen when the run was recorded.
    logging.disable(logging.WARNING)
    return gzserver.main(["gzserver", *arguments_of(recorded.facts, folder)], work)


def _open(page: contextlib.ExitStack, replay: Replay) -> None:
    """Opens the page, and waits until it is there and a user at a terminal wants to see the rest."""
    client = page.enter_context(gzserver.window([]))
    shown = f"/{gzserver.WINDOW_NAME}/window"
    wait_until(lambda: rospy.has_param(shown) or client.poll() is not None, WINDOW, "the page")
    if sys.stdin.isatty():
        print(f"at {replay.seconds:g} s; press Enter to play the rest", flush=True)
        sys.stdin.readline()


def _check(recorded: RecordedJournal, bag: Path, trust: bool) -> None:
    """Raises NoRecording if facts are wrong, or if foreign code would be imported and isn't trusted."""
    try:
        check_facts(recorded.facts)
    except ValueError as fault:
        raise NoRecording(f"{bag}: damaged: {fault}") from fault
    code = [] if trust else recorded.foreign_code()
    if code:
        raise NoRecording(f"{bag} would import {', '.join(code)}; if you trust it, add --trust")


def _judge(bag: Path, replay: Replay, until: float) -> int:
    """Says how the replay ended; returns the exit code."""
    if replay.difference:
        return _tell(f"{bag}: first difference: {replay.difference}", 1)
    if replay.was_interrupted:
        return gzserver.INTERRUPTED
    if not replay.seconds and until:
        return _tell(f"{bag}: no time passes in it, so there is nothing to compare", UNUSABLE)
    text = f"{bag}: equal to the bit: {replay.repeated} entries, {replay.seconds:g} s"
    if replay.unknown:
        text += f"; no states were recorded with the first {replay.unknown} of them"
    print(text, flush=True)
    return 0


def _tell(text: str, code: int) -> int:
    print(f"replay.py: {one_line(text)}", file=sys.stderr, flush=True)
    return code


def _pair(text: str) -> tuple[str, str]:
    name, _, path = text.partition("=")
    if not name or not path:
        raise argparse.ArgumentTypeError(f"{text}: a name, = and a file are needed")
    return name, path
