"""Clients that send garbage, stop halfway, vanish, or say nothing."""

from __future__ import annotations

import contextlib
import random
import socket
import struct
import threading
from collections import Counter
from collections.abc import Callable
from urllib.parse import urlsplit

SERVICE = "/gazebo/get_model_state"
PATIENCE = 0.2  # [s] until such a client goes on without an answer
Address = tuple[str, int]


def address(uri: str) -> Address:
    """Host and port of a rosrpc:// or http:// address."""
    place = urlsplit(uri)
    return str(place.hostname), int(place.port or 0)


def packed(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def header(*fields: bytes) -> bytes:
    return packed(b"".join(map(packed, fields)))


def _hello(dice: random.Random) -> bytes:
    """A client's header; sound, or with a fault in it."""
    fields = [b"callerid=/bad", b"md5sum=*", b"service=" + SERVICE.encode(), b"persistent=1"]
    if dice.random() < 0.5:
        at = dice.randrange(len(fields))
        fields[at] = dice.choice([b"", b"=", b"x", b"md5sum=", b"service=/none", dice.randbytes(20)])
    return header(*fields)


def _post(dice: random.Random) -> bytes:
    """An HTTP request of XML-RPC with a fault in it."""
    body = dice.choice(
        [
            b"<?xml version='1.0'?><methodCall><methodName>getPid</methodName><params>",
            b"<methodCall><methodName>getBusInfo</methodName></methodCall>",
            b"<?xml version='1.0'?><!DOCTYPE x [<!ENTITY a 'aaaaaaaaaa'>]><methodCall>&a;&a;</methodCall>",
            dice.randbytes(200),
            b"",
        ]
    )
    length = dice.choice([len(body), 10**9, -1, 0, 7])
    kind = dice.choice([b"POST /RPC2", b"POST /", b"GET /", b"PUT /x", b"\0\0", dice.randbytes(9)])
    return kind + b" HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n\r\n" % length + body


def bad_bytes(dice: random.Random, xmlrpc: bool) -> bytes:
    """What one of them says at first."""
    kinds: list[Callable[[], bytes]] = [
        lambda: b"",
        lambda: dice.randbytes(dice.randrange(1, 3000)),
        lambda: struct.pack("<I", dice.choice([0, 1, 2**31 - 1, 2**32 - 1, 10**7])) + b"x",
        lambda: _hello(dice)[: dice.randrange(60)],
        lambda: _hello(dice) + packed(dice.randbytes(dice.randrange(80))),
        lambda: _hello(dice) + struct.pack("<I", dice.choice([2**31, 10**8])) + bytes(9),
        lambda: _post(dice),
        lambda: b"GET / HTTP/1.1\r\n" + b"X: " + b"y" * dice.randrange(70_000),
        lambda: b"P",
    ]
    return kinds[dice.randrange(5, 9) if xmlrpc and dice.random() < 0.7 else dice.randrange(9)]()


class BadClient(threading.Thread):
    """Connects `count` times, each time with another fault, and holds some of its connections."""

    def __init__(self, places: tuple[Address, Address], dice: random.Random, count: int) -> None:
        super().__init__(name="bad client", daemon=True)
        self._places, self._dice, self._count = places, dice, count
        self.done: Counter[str] = Counter()

    def run(self) -> None:
        with contextlib.ExitStack() as held:
            for _ in range(self._count):
                self._connect(held)

    def _connect(self, held: contextlib.ExitStack) -> None:
        dice = self._dice
        xmlrpc = dice.random() < 0.4
        try:
            client = socket.create_connection(self._places[xmlrpc], 10.0)
        except OSError:
            self.done["refused"] += 1  # a crowd; the good client tells whether it is served
            return
        client.settimeout(PATIENCE)
        with contextlib.suppress(OSError):
            client.sendall(bad_bytes(dice, xmlrpc))
            if dice.random() < 0.5:
                client.recv(100)
        end = dice.choice(["close", "vanish", "half", "hold"])
        self.done[end] += 1
        if end == "hold":
            held.callback(client.close)
            return
        with contextlib.suppress(OSError):
            if end == "vanish":  # as a machine that is switched off: no goodbye, the rest is lost
                client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            elif end == "half":
                client.shutdown(socket.SHUT_WR)
                client.recv(100)
        client.close()
