"""A cluster of Ray's on this machine: each node with processes, ports and a folder of its own."""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

STORE = 80 * 2**20  # [bytes], hardly more than Ray's least
PATIENCE = 600.0  # [s], on a busy machine
QUIET = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_AUTH_MODE": "disabled",
         "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0"}  # fmt: skip


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])


def in_session(session: int) -> list[int]:
    """The processes of a session."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:  # it has ended
                continue
            if int(fields[3]) == session and fields[0] != "Z":
                found.append(int(entry.name))
    return found


def wait_until(condition: Callable[[], object], what: str, patience: float = PATIENCE) -> None:
    until = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < until, f"waited for {what}"
        time.sleep(0.05)


class RayNode:
    """`ray start --block` with flags in a session of its own, `without` some variables of the environment."""

    def __init__(self, flags: Sequence[str], without: Sequence[str] = ()) -> None:
        # Short, as sockets lie in it.
        self.folder = Path(tempfile.mkdtemp(prefix="ray_", dir="/tmp"))
        environment = {name: value for name, value in os.environ.items() if name not in without}
        ray = Path(sys.executable).with_name("ray")
        command = [sys.executable, str(ray), "start", "--block", "--num-cpus=1", *flags,
                   f"--temp-dir={self.folder}", f"--object-store-memory={STORE}"]  # fmt: skip
        self.log = (self.folder / "node.log").open("wb")
        self.process = subprocess.Popen(
            command, env={**environment, **QUIET, "TMPDIR": str(self.folder)},
            stdin=subprocess.DEVNULL, stdout=self.log, stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip

    def workers(self) -> list[int]:
        """Its processes that do a job, and the trainings that these have begun."""
        return [pid for pid in in_session(self.process.pid) if title(pid).startswith("ray::train")]

    def kill(self) -> None:
        """Ends all of its processes at once, as the loss of a machine would."""
        while found := in_session(self.process.pid):
            for pid in found:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
        self.process.wait()
        self.log.close()

    def remove(self) -> None:
        self.kill()
        shutil.rmtree(self.folder, ignore_errors=True)


def title(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


class RayCluster:
    """A head and further nodes, each with one core."""

    def __init__(self) -> None:
        self.port = free_port()
        self.address = f"127.0.0.1:{self.port}"
        self.nodes = [RayNode(["--head", f"--port={self.port}", "--include-dashboard=false"])]
        wait_until(self._answers, "the head of the cluster")

    def _answers(self) -> bool:
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0

    def add(self, without: Sequence[str] = ()) -> RayNode:
        node = RayNode([f"--address={self.address}"], without)
        self.nodes.append(node)
        return node

    def close(self) -> None:
        for node in reversed(self.nodes):
            node.remove()
