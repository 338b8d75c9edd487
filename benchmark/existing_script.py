#!/usr/bin/env python3
"""How the existing policy-gradient script learns on the stand-in, run unchanged in real time.

    ./ws python3 benchmark/existing_script.py [SCRIPT] [--episodes 200] [--out FOLDER]

Runs the script in a folder and on a master of its own until so many episodes are over, presses
Ctrl-C, looks for processes left behind, and writes existing_script.json and .png.
"""

import argparse
import contextlib
import datetime
import json
import os
import platform
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rl_workbench.plotting import as_png, learning_curve
from rl_workbench.storage import write_file

ROOT = Path(__file__).resolve().parent.parent
SCRIPT = ROOT.parent / "shared" / "pg_script" / "launch_robot_test.py"
LINE = re.compile(r"Episode (\d+), Step (\d+): Action=\S+, Reward=(\S+)")
BLOCK = 50  # [episodes] for each mean in the table
SILENCE = 120.0  # [s] without a step after which the script is taken to be stuck
MARK = "CARTPOLE_BENCHMARK"


class Watcher:
    """Follows the script's output: how long each episode is, and its return."""

    def __init__(self) -> None:
        self.lengths: list[int] = []  # of finished episodes
        self.returns: list[float] = []
        self.stepping: list[float] = []  # [s of wall time] from its first step to its last one
        self.first_step = time.monotonic()
        self.last_step = time.monotonic()
        self._steps, self._total = 0, 0.0

    def read(self, line: str) -> None:
        found = LINE.search(line)
        if not found:
            return
        episode, step, reward = int(found[1]), int(found[2]), float(found[3])
        if episode > len(self.lengths):
            self.lengths.append(self._steps)
            self.returns.append(self._total)
            self.stepping.append(self.last_step - self.first_step)
            self._total = 0.0
        self._steps, self._total = step + 1, self._total + reward
        self.last_step = time.monotonic()
        if step == 0:
            self.first_step = self.last_step


def follow(process: subprocess.Popen[str], watcher: Watcher, log: Path) -> threading.Thread:
    def read() -> None:
        assert process.stdout is not None
        with log.open("w") as copy:
            for line in process.stdout:
                watcher.read(line)
                if not line.startswith("Episode"):
                    copy.write(line)

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    return thread


def wait(process: subprocess.Popen[str], watcher: Watcher, episodes: int, log: Path) -> None:
    """Waits for the episodes, telling how far it is every ten seconds."""
    told = 0.0
    while len(watcher.lengths) < episodes:
        if process.poll() is not None:
            sys.exit(f"the script ended with {process.returncode}; its messages: {log}")
        if time.monotonic() - watcher.last_step > SILENCE:
            sys.exit(f"no step for {SILENCE:g} s; the script's messages: {log}")
        if time.monotonic() - told > 10:
            told = time.monotonic()
            print(f"{len(watcher.lengths)}/{episodes} episodes", file=sys.stderr, flush=True)
        time.sleep(0.1)


def marked(mark: str) -> dict[int, str]:
    """Processes whose environment carries the mark: the script and all that came of it."""
    found = {}
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError):
            command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode().strip()
            if command and f"{MARK}={mark}".encode() in (entry / "environ").read_bytes():
                found[int(entry.name)] = command
    return found


def press_ctrl_c(process: subprocess.Popen[str], mark: str) -> tuple[int, float, list[str]]:
    """Interrupts the script's process group, as a terminal does.

    Returns:
        Exit code, seconds until it had ended, command lines of what is left 10 s after that.
    """
    started = time.monotonic()
    os.killpg(process.pid, signal.SIGINT)
    code = process.wait(60)
    seconds = time.monotonic() - started
    deadline = time.monotonic() + 10
    while marked(mark) and time.monotonic() < deadline:
        time.sleep(0.1)
    return code, seconds, list(marked(mark).values())


def run(command: Sequence[str | Path], episodes: int, folder: Path) -> dict[str, Any]:
    """Runs a script in that folder, for so many episodes; returns the benchmark's result."""
    mark = uuid.uuid4().hex
    with socket.create_server(("127.0.0.1", 0)) as probe:
        master = f"http://127.0.0.1:{probe.getsockname()[1]}"
    started = time.monotonic()
    process = subprocess.Popen(
        [str(part) for part in command],
        cwd=folder,
        env=os.environ | {"PYTHONUNBUFFERED": "1", "ROS_MASTER_URI": master, MARK: mark},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    watcher = Watcher()
    follow(process, watcher, folder / "messages.txt")
    try:
        wait(process, watcher, episodes, folder / "messages.txt")
        seconds = time.monotonic() - started
        code, ending, left = press_ctrl_c(process, mark)
    finally:
        for pid in marked(mark):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
    lengths, returns = watcher.lengths[:episodes], watcher.returns[:episodes]
    return {
        "command": "benchmark/existing_script.py",
        "date": datetime.date.today().isoformat(),
        "machine": f"{platform.platform()}, {os.cpu_count()} cores",
        "seconds": round(seconds, 1),
        "mean_lengths": means(lengths),
        "one_step_episodes": lengths.count(1),
        "exit_code_after_ctrl_c": code,
        "seconds_to_end_after_ctrl_c": round(ending, 1),
        "processes_left": left,
        "steps_per_second": speed(lengths, watcher.stepping),
        "lengths": lengths,
        "returns": returns,
    }


def speed(lengths: Sequence[int], stepping: Sequence[float]) -> float:
    """Steps per second within episodes: without what lies between them, the learning."""
    pairs = list(zip(lengths, stepping, strict=False))
    return round(sum(steps - 1 for steps, _ in pairs) / max(sum(each for _, each in pairs), 1e-9))


def means(lengths: list[int]) -> dict[str, float]:
    blocks = {start: lengths[start : start + BLOCK] for start in range(0, len(lengths), BLOCK)}
    return {
        f"{start + 1}-{start + len(block)}": round(sum(block) / len(block), 1)
        for start, block in blocks.items()
    }


def report(result: dict[str, Any]) -> str:
    rows = [f"| {span} | {mean} |" for span, mean in result["mean_lengths"].items()]
    return "\n".join(
        [
            "| episodes | mean steps |",
            "|---|---|",
            *rows,
            f"steps per second within episodes: {result['steps_per_second']}",
            f"episodes of a single step: {result['one_step_episodes']}",
            f"after Ctrl-C: exit code {result['exit_code_after_ctrl_c']} in "
            f"{result['seconds_to_end_after_ctrl_c']} s, processes left: "
            f"{result['processes_left'] or 'none'}",
            f"{result['seconds']} s on {result['machine']}, {result['date']}",
        ]
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("script", nargs="?", type=Path, default=SCRIPT)
    parser.add_argument("--episodes", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("."), help="folder for JSON and PNG")
    chosen = parser.parse_args()
    if not chosen.script.is_file():
        parser.error(f"no such file: {chosen.script}")
    chosen.out.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="existing_script_"))
    result = run([sys.executable, chosen.script.resolve()], chosen.episodes, folder)
    (chosen.out / "existing_script.json").write_text(json.dumps(result, indent=1) + "\n")
    title = "the existing script, unchanged, in real time"
    figure = learning_curve(result["lengths"], result["returns"], title)
    write_file(chosen.out / "existing_script.png", as_png(figure))
    print(report(result))
    return 1 if result["processes_left"] else 0


if __name__ == "__main__":
    sys.exit(main())
