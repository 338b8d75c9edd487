"""A start that doesn't come back, as a lock that nobody releases."""

import signal
import subprocess
import sys

SCRIPT = """
import signal, sys, threading
from rl_workbench.training.cluster.obituary import obituary
from rl_workbench.training.cluster.stuck import ended_if_stuck
longest, grace = map(float, sys.argv[1:])
signal.signal(signal.SIGINT, lambda *_: None)  # as while Ray starts: it waits
with obituary("It is gone.") as told, ended_if_stuck("the cluster", told, longest, grace):
    pass
with obituary("It is gone.") as told, ended_if_stuck("the cluster", told, longest, grace):
    print("begins", flush=True)
    lock = threading.Lock()
    lock.acquire()
    lock.acquire()
"""
FOREVER = "100000"  # [s]


def started(longest: str, grace: str) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, longest, grace],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None and process.stdout.readline() == "begins\n"
    return process


def test_it_ends_with_a_line_after_its_time() -> None:
    _, said = (process := started("0.2", FOREVER)).communicate()
    assert said == "can't join the cluster: nothing came of it in 0.2 s; try again\n"
    assert process.returncode == -signal.SIGKILL


def test_ctrl_c_ends_it_a_little_later() -> None:
    process = started(FOREVER, "0.2")
    process.send_signal(signal.SIGINT)
    _, said = process.communicate()
    assert said == "interrupted, in the midst of a start of Ray's that didn't come back\n"
    assert process.returncode == -signal.SIGKILL
