"""Hooks that record rospy's requests, messages and parameter reads in the journal.

Plugins and controllers of users offer services, subscribe and read parameters with rospy alone (replay.test).
"""

import zlib
from collections.abc import Callable
from typing import Any

import genpy
import rospy
from bullet_gazebo_msgs.msg import JournalEntry
from rospy.impl.tcpros_service import ServiceImpl, convert_return_to_response
from rospy.msproxy import MasterProxy
from rospy.topics import _SubscriberImpl

from bullet_gazebo.journal.journal import Entry, WorldJournal
from ros_calls.service import bytes_of

# How names of services begin, behind the last slash, that only look, one that each node has, and
# advance_world, whose parts are recorded as commands and messages.
UNRECORDED = ("get_", "list_", "query_", "set_logger_level", "advance_world")
FAILED = 1  # in place of the CRC-32 of an answer, if the handler raised


def record_services(journal: WorldJournal) -> None:
    """Records the requests of the services that this process offers from now on."""
    init = ServiceImpl.__init__

    def init_recorded(
        service: ServiceImpl, name: str, kind: Any, handler: Callable[[Any], Any], *args: Any
    ) -> None:
        init(service, name, kind, handler, *args)
        if not service.resolved_name.rpartition("/")[2].startswith(UNRECORDED):
            # rospy makes a request of the class by which it receives.
            service.protocol.recv_data_class = _keeping_bytes(kind._request_class)
            service.handler = recorded(journal, service, handler)

    ServiceImpl.__init__ = init_recorded


def _keeping_bytes(request_class: Any) -> type[genpy.Message]:
    """Returns the class whose messages keep the bytes that they were made from, which costs no time."""

    class Request(request_class):
        def deserialize(self, data: bytes) -> Any:
            self.received = data
            return super().deserialize(data)

    return Request


def recorded(
    journal: WorldJournal, service: ServiceImpl, handler: Callable[[Any], Any]
) -> Callable[[Any], Any]:
    """Returns a handler of a service that records its requests."""
    name, kind = service.resolved_name, service.service_class

    def handle(request: Any) -> Any:
        caller = request._connection_header["callerid"]
        entry = Entry(JournalEntry.SERVICE, name, request.received, caller)
        if caller == rospy.get_name() or not journal.begin(entry):
            return handler(request)
        entry.type, entry.md5sum, entry.answer = kind._type, kind._md5sum, FAILED
        try:
            response = convert_return_to_response(handler(request), service.response_class)
            entry.answer = zlib.crc32(bytes_of(response)) if journal.listeners else 0
            return response
        finally:
            journal.end(entry)

    return handle


def record_messages(journal: WorldJournal) -> None:
    """Records the messages that this process's subscribers receive from other nodes."""
    receive = _SubscriberImpl.receive_callback

    def receive_recorded(
        subscription: _SubscriberImpl, messages: list[genpy.Message], connection: Any
    ) -> None:
        kind, caller = subscription.data_class, connection.callerid_pub
        if caller == rospy.get_name():  # what a plugin tells another one follows from other entries
            receive(subscription, messages, connection)
            return
        for message in messages:
            entry = Entry(JournalEntry.MESSAGE, subscription.resolved_name, bytes_of(message), caller)
            entry.type, entry.md5sum = kind._type, kind._md5sum
            entry.publishers = subscription.get_num_connections()
            is_first = journal.begin(entry)
            try:
                receive(subscription, [message], connection)
            finally:
                if is_first:
                    journal.end(entry)

    _SubscriberImpl.receive_callback = receive_recorded


def record_parameters(journal: WorldJournal) -> None:
    """Records the parameters that this process reads."""
    read = MasterProxy.__getitem__

    def read_recorded(proxy: MasterProxy, key: str) -> Any:
        try:
            value = read(proxy, key)
        except KeyError:
            journal.note_parameter(rospy.resolve_name(key), [])
            raise
        journal.note_parameter(rospy.resolve_name(key), [value])
        return value

    def contains(proxy: MasterProxy, key: str) -> bool:
        try:
            proxy[key]
        except KeyError:
            return False
        return True

    for name, method in (("__getitem__", read_recorded), ("__contains__", contains)):
        setattr(MasterProxy, name, method)
