"""What isn't a file is refused, not waited for."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from file_access.content import FileError, NotAFile, TooLarge, open_file, open_text, read_file

KINDS = ["pipe", "socket", "device", "folder"]


@pytest.fixture
def odd(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Path]:
    path = tmp_path / "odd"
    with socket.socket(socket.AF_UNIX) as server:
        make = {
            "pipe": lambda: os.mkfifo(path),
            "socket": lambda: server.bind(str(path)),
            "device": lambda: path.symlink_to("/dev/zero"),
            "folder": path.mkdir,
        }
        make[request.param]()
        yield path


@pytest.mark.parametrize("odd", KINDS, indirect=True)
def test_what_is_no_file_is_refused(odd: Path) -> None:
    for opening in (open_file, open_text):
        with pytest.raises(NotAFile, match="it is not a file") as raised:
            opening(odd)
        assert raised.value.filename == str(odd)
    with pytest.raises(FileError, match="^it is not a file$"):
        read_file(odd)


def test_files_are_read(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes("ä\r\n".encode())
    link = tmp_path / "link"
    link.symlink_to(path)
    with open_file(link) as file, open_text(path) as text:
        assert file.read() == "ä\r\n".encode() and text.read() == "ä\r\n"
    assert read_file(path, 4) == "ä\r\n".encode()
    with pytest.raises(FileNotFoundError):
        open_file(tmp_path / "none")
    with pytest.raises(TooLarge, match="it has more than 3 bytes"):
        read_file(path, 3)


@pytest.mark.parametrize(
    ("name", "fault"),
    [("loop", "Too many levels"), ("gone", "No such file"), ("x\0y", ""), ("x" * 300, "File name too long")],
)  # fmt: skip
def test_a_file_that_cannot_be_read_says_why(tmp_path: Path, name: str, fault: str) -> None:
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(FileError, match=f"^it can't be read: {fault}"):
        read_file(tmp_path / name)
