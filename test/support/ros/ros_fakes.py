"""A fake ROS master, and a fake node with one service, without ROS's servers."""

import contextlib
import io
import socket
import struct
import threading
import time
from functools import partial
from itertools import repeat
from pathlib import Path
from xmlrpc.server import SimpleXMLRPCServer

import rosgraph
from std_srvs.srv import SetBool, SetBoolResponse

from ros_calls.service import WORK

LOOPBACK = "127.0.0.1"


class FakeMaster:
    """Knows services and nodes by name and address, and parameters. It answers as a node, too."""

    def __init__(self):
        self.services = {}
        self.nodes = {}
        self.params = {}
        self.told = {}  # answers to getName and getMasterUri, as a node's
        self.questions = []
        self.work = repeat(0)  # as a simulator's that doesn't compute
        self._server = SimpleXMLRPCServer((LOOPBACK, 0), logRequests=False)
        self._server.register_function(lambda caller: [1, "", 1], "getPid")
        self._server.register_function(lambda caller: [1, "", next(self.work)], WORK)
        for method, known in (
            ("lookupService", self.services),
            ("lookupNode", self.nodes),
            ("getParam", self.params),
        ):
            self._server.register_function(partial(self._lookup, known), method)
        self._server.register_function(lambda caller, key: [1, "", key in self.params], "hasParam")
        self._server.register_function(self._set_param, "setParam")
        self._server.register_function(self._register_service, "registerService")
        self._server.register_multicall_functions()
        for method in ("getName", "getMasterUri"):
            self._server.register_function(partial(self._tell, method), method)
        self._server.register_function(lambda caller, name: "nonsense", "nonsense")
        self.uri = f"http://{LOOPBACK}:{self._server.server_address[1]}"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.01,))
        self._thread.start()

    def _lookup(self, known, caller, name):
        self.questions.append(name)
        return [1, "", known[name]] if name in known else [-1, "unknown", ""]

    def _set_param(self, caller, key, value):
        self.params[key] = value
        return [1, "", 0]

    def _register_service(self, caller, name, address, uri):
        self.services[name] = address
        return [1, "", 0]

    def _tell(self, method, caller):
        return [1, "", self.told[method]] if method in self.told else [-1, "unknown", ""]

    def close(self):
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


class FakeService:
    """Of any `kind`; `answer(request)` gives the pieces that are sent, or None to say nothing.

    A piece is sent once the one before was read, so that they arrive apart.
    """

    def __init__(self, answer=None, header=None, kind=SetBool):
        self._answer = answer or (lambda request: [ok(request.data)])
        self._header = header or {"callerid": "/fake", "md5sum": kind._md5sum, "type": kind._type}
        self._kind = kind
        self._listener = socket.create_server((LOOPBACK, 0))
        self.address = f"rosrpc://{LOOPBACK}:{self._listener.getsockname()[1]}"
        self.connections = []
        self.over = threading.Event()
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        with contextlib.suppress(OSError):  # closed
            while True:
                connection, _ = self._listener.accept()
                self.connections.append(connection)
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection):
        with contextlib.suppress(OSError, rosgraph.network.ROSHandshakeException):
            rosgraph.network.read_ros_handshake_header(connection, io.BytesIO(), 4096)
            if self._header == "silence":
                return
            rosgraph.network.write_ros_handshake_header(connection, self._header)
            while length := connection.recv(4, socket.MSG_WAITALL):
                data = connection.recv(struct.unpack("<I", length)[0], socket.MSG_WAITALL)
                request = self._kind._request_class()
                request.deserialize(data)
                for piece in self._answer(request) or ():
                    self._await_read(connection)
                    connection.sendall(piece)

    def _await_read(self, connection):
        while not (_is_read(connection) or self.over.is_set()):
            time.sleep(0.001)

    def break_off(self):
        """Ends all connections, as a node does that ends."""
        for connection in self.connections:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()

    def close(self):
        self.over.set()
        with contextlib.suppress(OSError):  # closed already
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.break_off()


def _is_read(connection):
    """Whether the client has taken all that was sent: no kernel holds anything of it."""
    here, there = connection.getsockname()[1], connection.getpeername()[1]
    queues = {}  # by the ports of either side: what waits to be sent, and to be read
    for line in Path("/proc/net/tcp").read_text().splitlines()[1:]:
        _, local, remote, _, waiting, *_ = line.split()
        ports = int(local.split(":")[1], 16), int(remote.split(":")[1], 16)
        queues[ports] = tuple(int(each, 16) for each in waiting.split(":"))
    sent, read = queues.get((here, there), (0, 0)), queues.get((there, here), (0, 0))
    return sent[0] == read[1] == 0


def ok(success, message=""):
    """An answer on the wire."""
    return on_wire(SetBoolResponse(success, message))


def on_wire(response):
    """The answer of a service that succeeds."""
    payload = io.BytesIO()
    response.serialize(payload)
    return b"\x01" + struct.pack("<I", payload.tell()) + payload.getvalue()


def failed(reason):
    """The answer of a service that fails."""
    data = reason.encode()
    return b"\x00" + struct.pack("<I", len(data)) + data
