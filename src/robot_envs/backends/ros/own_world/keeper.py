"""A program: a ROS master with one simulator under it, which end with the process that has started them.

It looks after them because nobody else can: a client that is killed by SIGKILL ends nothing any more. It
imports nothing of ours, so that it takes little memory.
"""

import os
import select
import signal
import subprocess
import sys
import threading

import rosmaster.master_api
from rosgraph.xmlrpc import XmlRpcNode

PATIENCE = 3.0  # [s] for a simulator to end when it is asked to
BINDING = 30.0  # [s] for a master to have its port
WORKERS = 3  # threads of a master, as roscore's has
PR_SET_PDEATHSIG = 1
# The kernel ends it with this process. It has no file of its own: one's folder would be its first to import
# from.
SIMULATOR = f"""
import ctypes, os, signal, sys
ctypes.CDLL(None).prctl({PR_SET_PDEATHSIG}, signal.SIGKILL)
if os.getppid() != int(sys.argv.pop(1)):
    sys.exit(1)
from bullet_gazebo.ros.node.gzserver import main
sys.exit(main())
"""


class CannotBind(Exception):
    """The master has no port; the text says why."""


def start_master() -> str:
    """Starts a master on a port that the kernel chooses; returns its address.

    Raises:
        CannotBind: if there is none.
    """
    settled = threading.Event()
    faults: list[Exception] = []

    def fail(fault: Exception) -> None:
        faults.append(fault)
        settled.set()

    class Handler(rosmaster.master_api.ROSMasterHandler):
        def _ready(self, uri: str) -> None:
            super()._ready(uri)
            settled.set()

    node = XmlRpcNode(0, Handler(WORKERS), on_run_error=fail)
    node.start()
    settled.wait(BINDING)
    if not node.uri or faults:
        raise CannotBind(f"the master has no port: {faults[0] if faults else 'no answer'}")
    return str(node.uri)


def main(argv: list[str]) -> int:
    """Runs both until one of the three ends, or a signal comes.

    Args:
        argv: the client's process id, the number of the file that is told address and process id of the
            simulator, and the simulator's arguments.

    Returns:
        0 after a signal; otherwise the simulator's exit code, or 128 and the number of its signal.
    """
    client, report = int(argv[1]), int(argv[2])
    heard, noted = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.set_wakeup_fd(noted)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: None)
    watched = os.pidfd_open(client)
    if os.getppid() != client:  # another process has its id already
        return 1
    try:
        uri = start_master()
    except CannotBind as fault:
        print(fault, file=sys.stderr, flush=True)
        return 1
    simulator = subprocess.Popen(
        [sys.executable, "-P", "-c", SIMULATOR, str(os.getpid()), *argv[3:]],
        env={**os.environ, "ROS_MASTER_URI": uri},
    )
    os.write(report, f"{uri} {simulator.pid}\n".encode())
    os.close(report)
    poll = select.poll()
    for file in (heard, watched, os.pidfd_open(simulator.pid)):
        poll.register(file, select.POLLIN)
    poll.poll()
    if simulator.poll() is not None:
        code = simulator.returncode
        return code if code >= 0 else 128 - code
    simulator.terminate()
    try:
        simulator.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        simulator.kill()
        simulator.wait()
    return 0


if __name__ == "__main__":
    code = main(sys.argv)
    sys.stderr.flush()
    os._exit(code)  # the master's threads wait for ever
