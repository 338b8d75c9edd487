"""A locale that writes 0,5 for one half, whatever locales the machine has."""

import struct
from pathlib import Path

NAME = "comma"
MAGIC, LC_NUMERIC = 0x20031115, 1
# Decimal point, thousands' separator and grouping, the first two again as wide characters, the charset.
FIELDS = (b",\0", b"\0", b"\0", struct.pack("=I", ord(",")), struct.pack("=I", 0), b"UTF-8\0")


def write_comma_locale(folder: Path) -> None:
    """Writes the locale NAME, with numbers alone; a process with LOCPATH=`folder` can choose it."""
    offsets, body = [], b""
    for field in FIELDS:
        body += bytes(-len(body) % 4)
        offsets.append(8 + 4 * len(FIELDS) + len(body))
        body += field
    head = struct.pack(f"={2 + len(FIELDS)}I", MAGIC ^ LC_NUMERIC, len(FIELDS), *offsets)
    (folder / NAME).mkdir()
    (folder / NAME / "LC_NUMERIC").write_bytes(head + body)
