"""The command lockstep.py (docs/lockstep.md)."""

import argparse
import contextlib
import os
import shlex
import sys
import threading
import types
from collections.abc import Sequence
from typing import Any

from lockstep_runner import script
from lockstep_runner.notices import tell

USAGE = 2
SERVER_ARGUMENTS = "GZSERVER_ARGS"  # every simulator that a descendant starts reads it
STEP_ON = "--step-on"
HASHES = "PYTHONHASHSEED"
MOST_SEED = 2**32 - 1
LONGEST = 3600.0  # [s] longest period at a trigger
NO_TRIGGERS = "none"
WITH_VALUE = ("--seed", "--dt", "--record")


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the script named on the command line; returns the exit code unless the script exits itself."""
    args = _parse(sys.argv[1:] if argv is None else argv)
    try:
        code = script.compiled(args.script)
    except script.NoScript as fault:
        tell(str(fault))
        return USAGE
    if args.seed is not None and os.environ.get(HASHES) != str(args.seed % MOST_SEED):
        # Python chooses its hash seed, and so the order of sets, at its start: run it again.
        os.environ[HASHES] = str(args.seed % MOST_SEED)
        os.execv(sys.executable, [sys.executable, *sys.argv])
    # Imported late: it takes as long as Python's start, and execv would make it happen twice
    from lockstep_runner.recording import recorded
    from lockstep_runner.world import RunsByItself, is_running

    try:
        if is_running() and args.record:
            tell("--record: a simulator runs already; record it with: rosbag record /gazebo/journal")
            return USAGE
    except RunsByItself as fault:
        tell(str(fault))
        return USAGE
    server = "--lockstep" if args.seed is None else f"--lockstep --seed {args.seed}"
    if args.record:
        server += f" --journal {shlex.quote(args.record)}"
    os.environ[SERVER_ARGUMENTS] = f"{os.environ.get(SERVER_ARGUMENTS, '')} {server}".strip()
    with recorded(args.record) if args.record else contextlib.nullcontext():
        return _run(args, code)


def _run(args: argparse.Namespace, code: types.CodeType) -> int:
    from lockstep_runner import on_demand
    from lockstep_runner.replaced import install
    from lockstep_runner.runner import watch

    runner = install(args)
    on_demand.follow_processes(runner)
    on_demand.replace_threads(runner)
    if args.seed is not None:
        script.seed_everything(args.seed)
    watch(runner)
    show = sys.excepthook

    def hide_ourselves(kind: Any, fault: BaseException, trace: Any) -> None:
        """Shows tracebacks that begin with the script."""
        fault.__traceback__ = script.own_part(trace, args.script)  # the default hook prints this
        show(kind, fault, fault.__traceback__)

    sys.excepthook = hide_ourselves
    try:
        script.run(args.script, args.arguments, code)
        threads = sys.modules.get("lockstep_runner.concurrency.python_threads")
        if threads is not None:
            threads.end_executors()
        others = [
            each for each in threading.enumerate() if not each.daemon and each is not threading.main_thread()
        ]
        runner.finish(others)
    finally:
        runner.hand_over()
        for name in runner.triggers.unused():
            seen = ", ".join(runner.triggers.seen) or "nothing"
            tell(f"--step-on {name}: the script used no topic or service of that name, but {seen}")
    sys.excepthook = show
    return 0


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="lockstep.py",
        description="Runs a script that was written for Gazebo, unchanged, in lock-step: repeatable, and as"
        " fast as it computes. A simulator that it launches comes up in lock-step.",
    )
    add = parser.add_argument
    add("--seed", type=_seed, help="seed random, NumPy, torch and the simulator")
    add("--dt", type=_period, default=0.008,
        help="simulated time that passes at each trigger [s], rounded up to whole physics steps"
        " (default: %(default)s)")  # fmt: skip
    add(STEP_ON, action="append", metavar="TOPIC-OR-SERVICE",
        help="let time pass at each message on this topic, or call of this service; may be repeated;"
        " 'none': no triggers (default: commands to controllers, if the script doesn't wait by"
        " itself)")  # fmt: skip
    add("--virtual-wall-clock", action="store_true",
        help="simulate time.time(), monotonic() and perf_counter(), too")  # fmt: skip
    add("--record", type=_writable, metavar="BAG",
        help="record the run in this bag, which replay.py repeats")  # fmt: skip
    add("script", help="the Python file to run")
    add("arguments", nargs=argparse.REMAINDER, help="arguments passed to the script")
    args = parser.parse_args(_one_by_one(argv))
    if NO_TRIGGERS in (args.step_on or ()) and set(args.step_on) != {NO_TRIGGERS}:
        parser.error(f"argument {STEP_ON}: '{NO_TRIGGERS}' can't be combined with other names")
    return args


def _one_by_one(argv: Sequence[str]) -> list[str]:
    """Repeats --step-on for each name behind it: otherwise argparse would take the script for a name."""
    left, given = list(argv), []
    while left:
        argument = left.pop(0)
        if argument != STEP_ON:
            given.append(argument)
            if not argument.startswith("-") and (not given[1:] or given[-2] not in WITH_VALUE):
                return given + left  # the script and its arguments
            continue
        names = []
        while left and not left[0].startswith("-"):
            if left[0].endswith(".py") or os.path.isfile(left[0]):
                break  # the script
            names.append(left.pop(0))
        given += [part for name in names for part in (STEP_ON, name)] or [STEP_ON]
    return given


def _seed(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and int(text) <= MOST_SEED):
        raise argparse.ArgumentTypeError(f"{text}: a whole number, 0 to {MOST_SEED}, is needed")
    return int(text)


def _writable(text: str) -> str:
    path = os.path.abspath(text)
    if os.path.isdir(path) or not os.access(os.path.dirname(path), os.W_OK):
        raise argparse.ArgumentTypeError(f"{text}: a file in a folder that can be written to is needed")
    return path


def _period(text: str) -> float:
    with contextlib.suppress(ValueError):
        value = float(text)
        if 0.0 < value <= LONGEST:
            return value
    raise argparse.ArgumentTypeError(f"{text}: must be above 0 and at most {LONGEST:g} seconds")
