"""Which master the calls of this package go to: ROS_MASTER_URI's, unless a block says otherwise."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar

import rosgraph

_chosen: ContextVar[str | None] = ContextVar("ros_utils_master", default=None)


def uri() -> str:
    """The master's address: the block's, or ``__master:=`` of the command line, or
    ROS_MASTER_URI."""
    return _chosen.get() or str(rosgraph.get_master_uri())


@contextlib.contextmanager
def using(master_uri: str | None) -> Iterator[None]:
    """Within the block, in this thread, calls go to another master; None changes nothing.

    The environment stays as it is, so nothing else in the process notices.
    """
    if master_uri is None:
        yield
        return
    token = _chosen.set(master_uri)
    try:
        yield
    finally:
        _chosen.reset(token)
