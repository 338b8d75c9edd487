"""Trainings on a Ray cluster: one task for each, in a folder that all nodes share.

Ray retries a task whose worker or node dies, and the training resumes from its own checkpoints, so only
the folder has to survive.
"""

import contextlib
import logging
import os
import secrets
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from file_access.locks import scratch_folder
from rl_workbench.errors import WorkbenchError, need
from rl_workbench.storage import as_text, write_file
from rl_workbench.tools.jobs import POLL, RETRIES, TIME_TO_END, Job, Killed, Program, attempt
from rl_workbench.training.folder import library_versions

TOKEN = ".seen_by_nodes"
CONNECT_TIMEOUT = 5.0  # [s]; Ray itself would try for more than a minute
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# Ray reads these as it is imported.
QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",  # sends nothing home
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",  # no warning about processors for graphics
    "RAY_DEDUP_LOGS_SKIP_REGEX": ".",  # nothing printed about workers and nodes that die
}


def train(job: Job, program: Program, folder: Path, token: str, wanted: dict[str, str]) -> str:
    """Runs one attempt at a training: Ray's task. Returns why it failed, or "".

    Raises:
        WorkbenchError: If this node doesn't see the folder, or has other versions of the libraries.
        Killed: If the process was killed; Ray tries again.
    """
    node, seen = socket.gethostname(), ""
    with contextlib.suppress(OSError):
        seen = (folder / TOKEN).read_text(encoding="utf-8")
    if seen != token:
        raise WorkbenchError(f"{node} doesn't see {folder}: --out must be a folder that all nodes share")
    versions = library_versions()
    others = [f"{name} {versions.get(name)}, not {its}" for name, its in wanted.items()
              if versions.get(name) != its]  # fmt: skip
    if others:
        raise WorkbenchError(f"{node} would not be bit-identical: it has {', '.join(others)}")
    modules = os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH"), program.modules]))
    here = Program((sys.executable, *program.words[1:]), modules)
    return attempt(job, here, lambda: False)


class RayTasks:
    """Runs jobs on a joined cluster."""

    def __init__(self, ray: Any, folder: Path, program: Program) -> None:
        token = secrets.token_hex(8)
        write_file(folder / TOKEN, as_text(token))
        self._ray = ray
        self._task = ray.remote(num_cpus=1, max_retries=RETRIES, retry_exceptions=[Killed])(train)
        self._arguments = program, folder, token, library_versions()
        nodes = sum(bool(each["Alive"]) for each in ray.nodes())
        self.cpus = int(ray.cluster_resources().get("CPU", 1))
        self.about = f"{nodes} node{'s' * (nodes > 1)} of a Ray cluster with {self.cpus} cores"

    def run(self, job: Job, is_stopped: Callable[[], bool]) -> str:
        """Runs a job until `is_stopped` returns True; returns why it failed, or ""."""
        ray = self._ray
        task = self._task.options(name=f"train {job.name}").remote(job, *self._arguments)
        while not ray.wait([task], timeout=POLL)[0]:
            if is_stopped():
                ray.cancel(task)  # raises KeyboardInterrupt in the task, which saves
                if not ray.wait([task], timeout=2.0 * TIME_TO_END)[0]:
                    ray.cancel(task, force=True)
                return ""
        try:
            return str(ray.get(task))
        except ray.exceptions.RayError as error:
            cause = getattr(error, "cause", None) or error  # the task's own error
            if isinstance(cause, WorkbenchError):
                raise WorkbenchError(str(cause)) from error
            return str(cause).strip().split("\n")[-1].strip()  # Ray's own messages are pages long


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
        options: dict[str, Any] = {}
        if address == "local":
            if "ray" not in sys.modules:  # Ray reads these when it is imported
                os.environ.update(RAY_AUTH_MODE="token", RAY_AUTH_TOKEN=secrets.token_hex(32))
            options = {
                "num_cpus": len(os.sched_getaffinity(0)),
                "object_store_memory": 128 * 2**20,  # [bytes]; jobs hardly use it
                "include_dashboard": False,
                # Short, so that Ray's sockets fit below.
                "_temp_dir": str(stack.enter_context(scratch_folder("/tmp"))),
            }
        elif address != "auto":
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
