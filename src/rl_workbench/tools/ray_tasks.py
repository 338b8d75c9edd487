"""Trainings on a Ray cluster: one task for each, in a folder that all nodes share.

Ray retries a task whose worker or node dies, and the training resumes from its own checkpoints, so only
the folder has to survive. A killed command is continued in the same way.
"""

import contextlib
import logging
import os
import secrets
import signal
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from file_access.locks import scratch_folder
from rl_workbench.errors import WorkbenchError, need
from rl_workbench.storage import as_text, write_file
from rl_workbench.tools.job import POLL, Ending, Job, Program, StopWithin, is_hopeless, run_attempt
from rl_workbench.training.folder import library_versions

TOKEN = ".seen_by_nodes"
LOCAL = "local"
CONNECT_TIMEOUT = 5.0  # [s]; Ray itself would try for more than a minute
OBJECT_STORE = 128 * 2**20  # [bytes] of a local cluster; jobs hardly use it
SOCKET_PATH = 31  # [bytes] of a temporary folder's path, so that Ray's sockets fit below
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# Ray reads these as it is imported.
QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",  # sends nothing home
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",  # no warning about processors for graphics
    "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0",
    "RAY_DEDUP_LOGS_SKIP_REGEX": ".",  # nothing printed about workers and nodes that die
}


class TrainingLost(Exception):
    """The training ended through no fault of its own, so Ray runs the task again."""


class NodeUnusable(Exception):
    """A node can't train; the text says why."""


def train(
    job: Job, program: Program, folder: Path, token: str, wanted: dict[str, str], since: float
) -> Ending:
    """Runs one attempt at a training in a separate process: Ray's task.

    Raises:
        NodeUnusable: If this node doesn't see the folder, or has other versions of the libraries.
        TrainingLost: If the process was killed.
    """
    node = socket.gethostname()
    try:
        seen = (folder / TOKEN).read_text(encoding="utf-8")
    except OSError:
        seen = ""
    if seen != token:
        raise NodeUnusable(
            f"{node} doesn't see {folder}: --out must be a folder that all nodes share"
        )
    versions = library_versions()
    wrong = [name for name, its in wanted.items() if versions.get(name) != its]
    others = [f"{name} {versions.get(name)}, not {wanted[name]}" for name in wrong]
    if others:
        raise NodeUnusable(f"{node} would not be bit-identical: it has {', '.join(others)}")
    if is_hopeless(job, since):
        return Ending(lost="its worker or its process was killed again and again")
    own = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    modules = os.pathsep.join(filter(None, [*own, program.modules]))
    here = Program((sys.executable, *program.words[1:]), modules)
    ending = run_attempt(job, here, lambda: None, since, death_signal="KILL")
    if ending.lost and not is_hopeless(job, since):
        raise TrainingLost(ending.lost)
    return ending


class RayJobs:
    """Runs jobs on a joined cluster."""

    def __init__(self, ray: Any, folder: Path, program: Program) -> None:
        self._ray, self._folder, self._program = ray, folder, program
        self._token, self._since = secrets.token_hex(8), time.time()
        self._wanted = library_versions()
        write_file(folder / TOKEN, as_text(self._token))
        self._task = ray.remote(num_cpus=1, max_retries=-1, retry_exceptions=[TrainingLost])(train)

    @property
    def cpus(self) -> int:
        """The number of cores of all nodes."""
        return int(self._ray.cluster_resources().get("CPU", 1))

    def about(self) -> str:
        """Returns the size of the cluster in half a line."""
        nodes = sum(bool(each["Alive"]) for each in self._ray.nodes())
        return f"{nodes} node{'s' * (nodes > 1)} of a Ray cluster with {self.cpus} cores"

    def run(self, job: Job, stop_within: StopWithin, say: Callable[[str], None]) -> Ending:
        """Runs a job to its end."""
        options = self._task.options(name=f"train {job.name}")
        task = options.remote(
            job, self._program, self._folder, self._token, self._wanted, self._since
        )
        deadline, was_stopped = float("inf"), False
        while not self._ray.wait([task], timeout=POLL)[0]:
            grace = stop_within()
            if grace is not None:
                deadline = min(deadline, time.monotonic() + grace)
                if not was_stopped:
                    self._ray.cancel(task)  # raises KeyboardInterrupt in the task, which saves
                    was_stopped = True
            if time.monotonic() > deadline:
                self._ray.cancel(task, force=True)
                return Ending()
        return self._result(task)

    def _result(self, task: Any) -> Ending:
        errors = self._ray.exceptions
        try:
            ending: Ending = self._ray.get(task)
            return ending
        except errors.TaskCancelledError:
            return Ending()
        except errors.RayError as error:
            cause = getattr(error, "cause", None)  # the task's own error
            if isinstance(cause, NodeUnusable | WorkbenchError):
                raise WorkbenchError(str(cause)) from error
            # Ray's own messages are pages long.
            lines = str(cause or error).strip().split("\n")
            return Ending(lost=lines[-1].strip() or type(cause or error).__name__)


@contextlib.contextmanager
def joined(address: str) -> Iterator[Any]:
    """Joins a cluster, or starts one on this machine; yields the module `ray`.

    `address` is the HOST:PORT of the head, "auto" for the cluster that this machine belongs to, or "local"
    for one that ends with the block.
    """
    need("ray", "Ray", "--ray")
    for name, value in QUIET.items():
        os.environ.setdefault(name, value)
    with contextlib.ExitStack() as stack:
        options = _local_cluster(stack) if address == LOCAL else {}
        if address not in (LOCAL, "auto"):
            _check_address(address)
        import ray

        before = {number: signal.getsignal(number) for number in SIGNALS}
        try:
            ray.init(address, log_to_driver=False, logging_level=logging.ERROR,
                     configure_logging=False, **options)  # fmt: skip
        except Exception as error:
            ray.shutdown()
            text = " ".join(str(error).split())
            raise WorkbenchError(f"can't join the Ray cluster {address}: {text}") from error
        finally:
            for number, handler in before.items():  # Ray's own would end this process at once
                signal.signal(number, handler)
        stack.callback(ray.shutdown)
        yield ray


def _local_cluster(stack: contextlib.ExitStack) -> dict[str, Any]:
    """Returns options for a private cluster on this machine; the stack removes its files."""
    if "ray" not in sys.modules:  # Ray reads these when it is imported
        os.environ.update(RAY_AUTH_MODE="token", RAY_AUTH_TOKEN=secrets.token_hex(32))
    where = None if len(tempfile.gettempdir()) < SOCKET_PATH else "/tmp"
    return {
        "num_cpus": len(os.sched_getaffinity(0)),
        "object_store_memory": OBJECT_STORE,
        "include_dashboard": False,
        "_temp_dir": str(stack.enter_context(scratch_folder(where))),
    }


def _check_address(address: str) -> None:
    host, _, port = address.rpartition(":")
    if not host or "/" in host or not port.isdecimal():
        raise WorkbenchError(
            "--ray is the HOST:PORT of a cluster's head, as 10.0.0.1:6379, or auto, or local, "
            f"not {address!r}"
        )
    try:
        socket.create_connection((host.strip("[]"), int(port)), CONNECT_TIMEOUT).close()
    except (OSError, OverflowError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise WorkbenchError(f"no Ray cluster answers at {address}: {reason}") from error
