"""Joining a cluster of Ray's, or starting one on this machine for as long as it is used."""

import contextlib
import logging
import os
import secrets
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from typing import Any

from rl_workbench.errors import WorkbenchError, need
from rl_workbench.training.cluster.address import AUTO, LOCAL, check_address, without_auto
from rl_workbench.training.cluster.head import ANOTHER_TOKEN, check_head, head_of_this_machine
from rl_workbench.training.cluster.nodes import Cluster
from rl_workbench.training.cluster.obituary import obituary
from rl_workbench.training.cluster.scratch import scratch_folder
from rl_workbench.training.cluster.stuck import ended_if_stuck
from rl_workbench.training.progress import warn

STORE = 128 * 2**20  # [bytes] of a local cluster's object store, which jobs hardly use
SOCKETS = 107  # [bytes] in the path of a socket, at most
SESSION = len(
    "/ray_1234567_12345678/session_2000-01-01_00-00-00_000000_1234567/sockets/plasma_store"
)
# What Ray reads as it is imported: nothing is sent home, nothing is told but errors, `uv` isn't looked for.
QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0",
    "RAY_DEDUP_LOGS_SKIP_REGEX": ".",  # what its daemons say of workers and nodes that die: pages
}
LOCAL_GCS = "RAY_gcs_rpc_server_reconnect_timeout_s"  # a minute, unless told otherwise
LOCAL_GCS_PATIENCE = 10  # [s]: on the same machine it is either there or lost
PATIENCE = 60.0  # [s] until every node has started a worker that answers
LOST = "this process was ended from outside, as by kill -9, or by Ray, since its node on this machine is lost"
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextlib.contextmanager
def joined(address: str, going_on: str, say: Callable[[str], None] = warn) -> Iterator[Cluster]:
    """A cluster, as long as it is entered; of this process's handlers of signals none is changed.

    Args:
        address: HOST:PORT of its head; `auto`: the one that this machine belongs to; `local`: one of
            this process's own, which ends with it.
        going_on: how the user does, if this process is ended without a word.
        say: is told of nodes that can't be used.

    Raises:
        WorkbenchError: if Ray isn't installed, no cluster is there, it has another version of Ray or
            Python, or none of its nodes can be used.
    """
    need("ray", "Ray", "--ray")
    for name, value in QUIET.items():
        os.environ.setdefault(name, value)
    with contextlib.ExitStack() as stack:
        last_words = f"{LOST}; {going_on}"
        if address == LOCAL:
            ray = _started(stack, last_words)
        else:
            ray = _found(stack, without_auto(address), last_words)
        stack.callback(ray.shutdown)
        cluster = Cluster(ray, say, ray.get_runtime_context().get_node_id())
        cluster.update(PATIENCE)
        if not cluster.nodes:
            raise WorkbenchError(f"no node of the cluster at {address} can be used")
        yield cluster


def _started(stack: contextlib.ExitStack, last_words: str) -> Any:
    """A cluster on this machine that nobody else can use; its files go with it."""
    place = tempfile.gettempdir()
    if len(os.fsencode(place)) + SESSION > SOCKETS:
        place = "/tmp"
    folder = stack.enter_context(scratch_folder("ray", place))
    told = stack.enter_context(obituary(last_words, folder))
    _keep_for_oneself()
    return _init(
        "a local cluster",
        told,
        address=LOCAL,
        num_cpus=local_processors(),
        object_store_memory=STORE,
        include_dashboard=False,
        _temp_dir=str(folder),
    )


def local_processors() -> int:
    """How many a local cluster has."""
    return len(os.sched_getaffinity(0))


def _keep_for_oneself() -> None:
    """A local cluster obeys nobody else on this machine. Ray reads this once, as it is imported."""
    if "ray" not in sys.modules:
        os.environ.update(RAY_AUTH_MODE="token", RAY_AUTH_TOKEN=secrets.token_hex(32))
    os.environ.setdefault("RAY_worker_niceness", "0")
    os.environ.setdefault(LOCAL_GCS, str(LOCAL_GCS_PATIENCE))


def _found(stack: contextlib.ExitStack, address: str, last_words: str) -> Any:
    told = stack.enter_context(obituary(last_words))
    if address == AUTO:
        address = head_of_this_machine()
    check_address(address)
    check_head(address)
    return _init(f"the Ray cluster at {address}", told, address=address)


def _init(what: str, last_words: int, **options: Any) -> Any:
    """Ray, initialised.

    Raises:
        WorkbenchError: if it can't be.
        KeyboardInterrupt: if the user ends the process meanwhile.
    """
    import ray

    before = {number: signal.getsignal(number) for number in SIGNALS}
    caught: list[int] = []
    for (
        number,
        handler,
    ) in before.items():  # interrupted in the middle, Ray's own threads crash at the end
        if handler != signal.SIG_IGN:
            signal.signal(number, lambda which, frame: caught.append(which))
    try:
        with ended_if_stuck(what, last_words):
            ray.init(
                log_to_driver=False, logging_level=logging.ERROR, configure_logging=False, **options
            )
    except SystemExit as error:  # by a handler of Ray's, that is in force meanwhile
        ray.shutdown()
        signal.signal(signal.SIGTERM, before[signal.SIGTERM])
        signal.raise_signal(signal.SIGTERM)
        raise KeyboardInterrupt from error
    except Exception as error:  # Ray raises that itself, where a node is too slow to start
        ray.shutdown()
        text = " ".join(str(error).split())
        if isinstance(error, ConnectionError):
            text += f"; it may have ended, or {ANOTHER_TOKEN}"
        raise WorkbenchError(f"can't join {what}: {text}") from error
    finally:
        for number, handler in before.items():  # Ray's own would leave out what ours save
            signal.signal(number, handler)
    try:
        for each in caught:
            signal.raise_signal(each)
    except BaseException:
        ray.shutdown()
        raise
    return ray
