"""Where a simulator's clients connect, and the headers that they send."""

import struct
from urllib.parse import urlsplit

SERVICE = "/gazebo/get_model_state"
Address = tuple[str, int]


def address(uri: str) -> Address:
    """Host and port of a rosrpc:// or http:// address."""
    place = urlsplit(uri)
    return str(place.hostname), int(place.port or 0)


def packed(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def header(*fields: bytes) -> bytes:
    return packed(b"".join(map(packed, fields)))
