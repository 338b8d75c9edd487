"""rospy.ServiceProxy: connections that last. Service calls of rospy and of ros_utils: time that may pass."""

from __future__ import annotations

import io
import select
import threading
from typing import Any
from weakref import WeakKeyDictionary

import rospy
import rospy.impl.tcpros_service
from rospy.impl.tcpros_service import ServiceProxy

from lockstep_runner.runner import Runner
from lockstep_runner.simulation.world import SERVICE as ADVANCE
from ros_calls.service import ServiceClient


def install(runner: Runner) -> None:
    """Puts the methods in place."""
    begin, call = ServiceProxy.__init__, ServiceProxy.call

    def beginning(
        self: ServiceProxy,
        name: str,
        service_class: Any,
        persistent: bool = False,
        headers: Any = None,
    ) -> None:
        begin(self, name, service_class, True, headers)
        self._lockstep_guard = threading.Lock()
        self._lockstep_kept = not persistent

    def calling(self: ServiceProxy, *args: Any, **kwds: Any) -> Any:
        request = rospy.msg.args_kwds_to_message(self.request_class, args, kwds)
        if self.service_class._type == "std_srvs/Empty" and runner.switches(self.resolved_name):
            return self.response_class()
        runner.before_call(self.resolved_name)
        if self._lockstep_guard.acquire(blocking=False):
            try:
                _drop_if_broken(self)
                answer = call(self, request)
            except rospy.ServiceException:
                _drop(self)
                raise
            finally:
                self._lockstep_guard.release()
        else:  # another thread is in the middle of a call
            proxy = ServiceProxy(self.resolved_name, self.service_class)
            try:
                answer = call(proxy, request)
            finally:
                proxy.close()
        runner.called(self.resolved_name, lambda: _bytes(request))
        return answer

    ServiceProxy.__init__ = beginning
    ServiceProxy.call = calling
    _let_time_pass_with(runner, ServiceClient)


def _let_time_pass_with(runner: Runner, kind: type[ServiceClient]) -> None:
    """The same for those of ros_utils, whose connections are its own affair; a call is begun and ended."""
    begin, end = kind.begin, kind.end
    requests: WeakKeyDictionary[ServiceClient, tuple[Any, ...]] = WeakKeyDictionary()

    def beginning(self: ServiceClient, *request: Any) -> None:
        if self.name != ADVANCE:  # which is ours
            runner.before_call(self.name)
            requests[self] = request
        begin(self, *request)

    def ending(self: ServiceClient) -> Any:
        answer = end(self)
        if self.name != ADVANCE:
            runner.called(self.name, lambda: repr(requests[self]).encode())
        return answer

    kind.begin = beginning  # type: ignore[method-assign]
    kind.end = ending  # type: ignore[method-assign]


def _drop_if_broken(proxy: ServiceProxy) -> None:
    """A kept connection has nothing to say between two calls, unless its other end has gone."""
    if proxy._lockstep_kept and proxy.transport is not None:
        connection = proxy.transport.socket
        if connection is None or select.select([connection], [], [], 0)[0]:
            _drop(proxy)


def _drop(proxy: ServiceProxy) -> None:
    if proxy._lockstep_kept and proxy.transport is not None:
        proxy.transport.close()
        proxy.transport = None


def _bytes(request: Any) -> bytes:
    buffer = io.BytesIO()
    request.serialize(buffer)
    return buffer.getvalue()
