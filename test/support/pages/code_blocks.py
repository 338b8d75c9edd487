"""Blocks of code of a page of the documentation."""

import re
from pathlib import Path
from typing import NamedTuple

BLOCK = re.compile(r"^( *)```(\S+)(?: (\S+))?\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    language: str
    mark: str
    text: str


def blocks(page: Path) -> list[Block]:
    return [
        Block(match[2], match[3] or "", re.sub(f"^{match[1]}", "", match[4], flags=re.MULTILINE))
        for match in BLOCK.finditer(page.read_text(encoding="utf-8"))
    ]
