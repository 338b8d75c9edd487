"""XML-RPC, as masters, nodes and roslaunch answer it, with a time limit.

rospy's own proxies have none: behind a dead network they hang their callers for minutes.
"""

from __future__ import annotations

import http.client
import xmlrpc.client
from typing import Any
from xml.parsers.expat import ExpatError

CALLER = "/ros_calls"  # whom a master or node notes; nothing depends on it
TIMEOUT = 2.0  # [s] for one question to a master or node; a live one answers in milliseconds


class NoAnswer(Exception):
    """Nothing usable came back; the text says why."""


class NobodyListens(NoAnswer):
    """The connection was refused."""


class BadAnswer(NoAnswer):
    """Somebody answers, but not in ROS's way, or doesn't know the method."""


class Refused(Exception):
    """The other side answered, and its answer is no."""


class _Transport(xmlrpc.client.Transport):
    """XML-RPC over HTTP with a time limit on every socket operation."""

    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


def call(uri: str, method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Calls a method of a master or node, which want the caller's name as first argument.

    See `call_plain`.
    """
    return call_plain(uri, method, CALLER, *args, timeout=timeout)


def call_plain(uri: str, method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Calls a method of something that answers in ROS's way, ``[code, text, value]``.

    Args:
        uri: its ``http://`` address.
        method: the method's name.
        args: all of its arguments.
        timeout: wall time [s] that connecting, sending and each part of the answer may take.

    Returns:
        The value.

    Raises:
        NoAnswer: nothing usable came back.
        Refused: the answer's code is not 1.
    """
    try:
        with xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout)) as proxy:
            code, text, value = getattr(proxy, method)(*args)
    except TimeoutError as fault:
        raise NoAnswer(f"no answer within {timeout:g} s") from fault
    except ConnectionRefusedError as fault:
        raise NobodyListens(fault.strerror or str(fault)) from fault
    except OSError as fault:
        raise NoAnswer(fault.strerror or str(fault)) from fault
    except (
        http.client.HTTPException,
        xmlrpc.client.Error,
        ExpatError,
        TypeError,
        ValueError,
    ) as fault:
        raise BadAnswer(f"an answer that is not ROS's: {type(fault).__name__}") from fault
    if code != 1:
        raise Refused(text)
    return value
