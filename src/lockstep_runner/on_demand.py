"""Deferred replacement of threads and processes, until the script uses them."""

import atexit
import builtins
import contextlib
import os
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

from file_access.locks import scratch_folder
from lockstep_runner import originals
from lockstep_runner.runner import ScriptRunner
from lockstep_runner.script import ADDRESS, is_the_script

if TYPE_CHECKING:
    from lockstep_runner.concurrency.followers import Followers

THREADS = ("concurrent", "queue", "threading")  # modules of Python's
SITE = Path(__file__).with_name("concurrency") / "site"


def replace_threads(runner: ScriptRunner) -> None:
    """Replaces what waits in threads when the script, or a module of its own, imports them."""
    find = builtins.__import__

    def importing(name: str, *args: Any, **kwds: Any) -> Any:
        if name.partition(".")[0] in THREADS and is_the_script(1):
            builtins.__import__ = find
            from lockstep_runner.concurrency.python_threads import replace

            replace(runner)
        return find(name, *args, **kwds)

    builtins.__import__ = importing


def follow_processes(runner: ScriptRunner) -> None:
    """Makes time wait for the script's processes, and nodes among them follow its clock."""
    folder = contextlib.ExitStack()
    address = str(folder.enter_context(scratch_folder()) / "clock")
    atexit.register(folder.close)
    paths = [str(SITE), *filter(None, [os.environ.get("PYTHONPATH")])]
    os.environ.update({"PYTHONPATH": os.pathsep.join(paths), ADDRESS: address})
    begin, system = subprocess.Popen.__init__, os.system
    guard, made = originals.Condition(), list["Followers"]()

    def followers() -> "Followers":
        with guard:
            if not made:
                from lockstep_runner.concurrency.followers import Followers

                made.append(Followers(address, runner))
        return made[0]

    def popen(process: Any, *args: Any, **kwds: Any) -> None:
        starting = followers().starting
        begin(process, *args, **kwds)
        starting.is_going_on = True

    def run(command: Any) -> int:
        followers().starting.is_going_on = True
        return system(command)

    runner.topics.follows = lambda node: bool(made) and made[0].has(node)
    subprocess.Popen.__init__ = popen  # type: ignore[method-assign, assignment]
    os.system = run
