"""A program that runs a ROS master and one simulator, and ends both with the process that started it.

A client that is killed by SIGKILL can't end anything itself, so a process of its own watches it. This module
imports nothing of this project, to take little memory.
"""

import os
import select
import signal
import subprocess
import sys
import time

from rosgraph.xmlrpc import XmlRpcNode
from rosmaster.master_api import ROSMasterHandler

TERMINATION = 3.0  # [s] that a simulator gets to end after SIGTERM
WORKERS = 3  # threads of the master, as roscore's has
PR_SET_PDEATHSIG = 1
# The kernel ends the simulator with this process. It is a text rather than a file, since Python would search
# a file's folder first for every import.
SIMULATOR = f"""
import ctypes, os, signal, sys
ctypes.CDLL(None).prctl({PR_SET_PDEATHSIG}, signal.SIGKILL)
if os.getppid() != int(sys.argv.pop(1)):
    sys.exit(1)
from bullet_gazebo.node.gzserver import main
sys.exit(main())
"""


def start_master() -> str:
    """Starts a master on a port that the kernel chooses; returns its address."""

    def give_up(error: Exception) -> None:
        print(f"the master has no port: {error}", file=sys.stderr, flush=True)
        os._exit(1)

    node = XmlRpcNode(0, ROSMasterHandler(WORKERS), on_run_error=give_up)
    node.start()
    while not node.uri:
        time.sleep(0.001)
    return str(node.uri)


def main(argv: list[str]) -> int:
    """Runs master and simulator until the simulator or the client ends, or a signal comes.

    `argv` has the client's process id and the simulator's arguments. Standard output gets the master's
    address and the simulator's process id, standard error all else. Returns 0 after a signal, else the
    simulator's exit code, or 128 + signal.
    """
    client = int(argv[1])
    signalled, wakeup = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.set_wakeup_fd(wakeup)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: None)
    watched = os.pidfd_open(client)
    if os.getppid() != client:  # it has ended already, and its id may be another process's
        return 1
    uri = start_master()
    simulator = subprocess.Popen(
        [sys.executable, "-P", "-c", SIMULATOR, str(os.getpid()), *argv[2:]],
        stdout=sys.stderr,
        env={**os.environ, "ROS_MASTER_URI": uri},
    )
    print(uri, simulator.pid, flush=True)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    poll = select.poll()
    for file in (signalled, watched, os.pidfd_open(simulator.pid)):
        poll.register(file, select.POLLIN)
    poll.poll()
    if simulator.poll() is not None:
        code = simulator.returncode
        return code if code >= 0 else 128 - code
    simulator.terminate()
    try:
        simulator.wait(TERMINATION)
    except subprocess.TimeoutExpired:
        simulator.kill()
        simulator.wait()
    return 0


if __name__ == "__main__":
    code = main(sys.argv)
    sys.stderr.flush()
    os._exit(code)  # the master's threads never end
