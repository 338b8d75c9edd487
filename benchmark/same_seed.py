#!/usr/bin/env python3
"""What a training with one seed comes to, run again: in Gazebo's way, and in lock-step.

    ./ws python3 benchmark/same_seed.py [SCRIPT] [--episodes 40] [--out FOLDER]

Runs a script in real time twice, and by lockstep.py on each engine twice, the second time beside a busy
process on each core. Without SCRIPT it is examples/learn_over_services.py; any other prints
"Episode N, Step M: Action=A, Reward=R". Writes same_seed.png and same_seed.json, and prints a digest of
each run's rewards, to compare with other machines.
"""

import argparse
import contextlib
import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import reporting
from existing_script import MARK, ROOT, Watcher, follow, marked, wait

from rl_workbench.plotting import as_png, new_figure
from rl_workbench.storage import write_file
from ros_utils.simulation import reserved_port

EXAMPLE = ROOT / "examples" / "learn_over_services.py"
SEEDED = (
    "import random, runpy, sys, numpy; random.seed(0); numpy.random.seed(0);"
    " runpy.run_path(sys.argv[1], run_name='__main__')"
)
LOCKSTEP = [sys.executable, ROOT / "scripts" / "lockstep.py", "--seed", "0"]
WAYS: dict[str, tuple[list[Any], str]] = {  # command before the script, and arguments of gzserver
    "real time": ([sys.executable, "-c", SEEDED], ""),
    "lock-step, PyBullet": (LOCKSTEP, ""),
    "lock-step, MuJoCo": (LOCKSTEP, "--physics mujoco"),
}


@contextlib.contextmanager
def busy(is_busy: bool) -> Iterator[None]:
    """Keeps all cores busy with something else."""
    count = (os.cpu_count() or 1) if is_busy else 0
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for each in others:
            each.kill()
            each.wait()


def returns_of(command: list[Any], episodes: int, arguments: str) -> list[float]:
    """Runs a script with these arguments of gzserver until so many episodes are over, and ends all of it."""
    folder = Path(tempfile.mkdtemp(prefix="same_seed_"))
    mark = uuid.uuid4().hex
    own = {"ROS_MASTER_URI": f"http://127.0.0.1:{reserved_port()}", "GZSERVER_ARGS": arguments}
    process = subprocess.Popen(
        [str(part) for part in command], cwd=folder,
        env={**os.environ, **own, "PYTHONUNBUFFERED": "1", MARK: mark},
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    watcher = Watcher()
    follow(process, watcher, folder / "messages.txt")
    try:
        wait(process, watcher, episodes, folder / "messages.txt")
    finally:
        for pid in marked(mark):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
    return watcher.returns[:episodes]


def digest(returns: list[float]) -> str:
    return hashlib.sha256(repr(returns).encode()).hexdigest()[:12]


def picture(results: dict[str, list[list[float]]]) -> Any:
    """Draws the returns of each way's runs over each other."""
    figure = new_figure(10, 3.5)
    for axes, (way, runs) in zip(figure.subplots(1, len(results), sharey=True), results.items(), strict=True):
        same = f"twice {digest(runs[0])}" if runs[0] == runs[1] else "two results"
        axes.plot(runs[0], lw=4, alpha=0.35, label="first run")
        axes.plot(runs[1], lw=1.2, color="tab:red", label="second run, busy")
        axes.set_title(f"{way}: {same}", fontsize=10)
        axes.set_xlabel("episode")
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("return")
    lines, names = figure.axes[0].get_legend_handles_labels()
    figure.legend(lines, names, loc="outside upper center", ncols=2, frameon=False)
    return figure


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("script", nargs="?", type=Path, default=EXAMPLE)
    parser.add_argument("--episodes", type=int, default=40)
    parser.add_argument("--out", type=Path, default=Path("runs/benchmark"), help="folder for JSON and PNG")
    chosen = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # processes of a run end with it
    results: dict[str, list[list[float]]] = {}
    for way, (before, arguments) in WAYS.items():
        for is_busy in (False, True):
            command = [*before, chosen.script.resolve()]
            with busy(is_busy):
                returns = returns_of(command, chosen.episodes, arguments)
            results.setdefault(way, []).append(returns)
            print(f"{way}, {'busy' if is_busy else 'idle'}: {digest(returns)}", flush=True)
    reporting.write(chosen.out, "same_seed", results)
    write_file(chosen.out / "same_seed.png", as_png(picture(results)))
    return int(any(runs[0] != runs[1] for way, runs in results.items() if way != "real time"))


if __name__ == "__main__":
    sys.exit(main())
