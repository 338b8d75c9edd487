"""Clients that say nothing, or nonsense: rospy would let them keep the others out, or wait for ever.

rospy offers no other way to it, hence its private names.
"""

import socket
import threading

import rospy
import rospy.impl.tcpros_base
from rospy.exceptions import TransportException
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_service import ServiceImpl


def guard_connections() -> None:
    """For a node that offers services, once it is initialised and before it offers them."""
    _greet_clients_apart()
    _hang_up_on_nonsense()


def _greet_clients_apart() -> None:
    """Has each new connection's header read in a thread of its own.

    rospy reads it in the thread that accepts connections. A client that connects and is then stopped, or
    hangs, keeps everybody else out of all the node's services and topics for as long as it lives.
    """
    server = rospy.impl.tcpros_base._tcpros_server.tcp_ros_server
    handle = server.inbound_handler

    def greet(client: socket.socket, address: tuple[str, int]) -> None:
        threading.Thread(
            target=handle, args=(client, address), name="greeting", daemon=True
        ).start()

    server.inbound_handler = greet


def _hang_up_on_nonsense() -> None:
    """Closes the connection after a request that can't be read, instead of leaving its client waiting."""
    handle = ServiceImpl.handle

    def guarded(service: ServiceImpl, transport: TCPROSTransport, header: dict[str, str]) -> None:
        try:
            handle(service, transport, header)
        except TransportException as error:
            rospy.logwarn("A request to %s can't be read: %s", service.resolved_name, error)
        finally:
            transport.close()

    ServiceImpl.handle = guarded
