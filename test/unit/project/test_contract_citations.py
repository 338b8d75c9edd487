"""Citations such as docs/contract/gazebo.md 2.1 lead to a section (docs/contract/README.md)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
CONTRACT = ROOT / "docs" / "contract"
ROOMS = ("src", "test", "companions", "docs", "benchmark", "examples", "scripts", "launch")
SUFFIXES = {"", ".py", ".md", ".launch", ".test", ".xml", ".yaml", ".msg", ".srv", ".action"}

NUMBER = r"\d+(?:\.\d+)?"
NUMBERS = rf"{NUMBER}(?:(?:, | and | to ){NUMBER})*"
CITATION = re.compile(rf"docs/contract/([\w.]+\.md)\b(?: ({NUMBERS}))?")
LINK = re.compile(rf"\]\((\w+\.md)\)(?: ({NUMBERS}))?")  # from one page of the contract to another
OWN = re.compile(rf"\((\d+\.\d+(?:(?:, | and | to ){NUMBER})*)\)")  # within a page
HEADING = re.compile(rf"^#{{2,3}} ({NUMBER}) \S", re.MULTILINE)


def read(path: Path) -> str:
    """A file as one line, so that a citation may be broken; comments' leaders are left out."""
    return re.sub(r"\s*\n\s*(?:# )?", " ", path.read_text(encoding="utf-8"))


def files() -> Iterator[Path]:
    """All text files of the rooms."""
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*")):
            if path.is_file() and path.suffix in SUFFIXES and "__pycache__" not in path.parts:
                yield path


def sections(page: Path) -> list[str]:
    return HEADING.findall(page.read_text(encoding="utf-8"))


def expanded(numbers: str) -> list[str]:
    """All sections that a citation means: "1.2 to 1.4, 2 and 3.1" is 1.2, 1.3, 1.4, 2, 3.1."""
    found: list[str] = []
    for piece in re.split(r", | and ", numbers):
        first, _, last = piece.partition(" to ")
        chapter, _, start = first.rpartition(".")
        if last and last.rpartition(".")[0] != chapter:
            raise ValueError(f"'{piece}' begins and ends in different chapters")
        dot = "." if chapter else ""
        stop = int(last.rpartition(".")[2]) if last else int(start)
        found += [f"{chapter}{dot}{number}" for number in range(int(start), stop + 1)]
    return found


def missing(name: str, numbers: str) -> list[str]:
    """What of a citation doesn't exist: the page, or sections of it."""
    page = CONTRACT / name
    if not page.is_file():
        return [name]
    there = sections(page)
    return [number for number in expanded(numbers) if number not in there] if numbers else []


TEXTS = {path: read(path) for path in files()}
CITED = [
    (str(path.relative_to(ROOT)), name, numbers)
    for path, text in TEXTS.items()
    for name, numbers in CITATION.findall(text)
]
PAGES = sorted(CONTRACT.glob("*.md"))


@pytest.mark.parametrize(("where", "name", "numbers"), CITED)
def test_what_is_cited_exists(where: str, name: str, numbers: str) -> None:
    assert missing(name, numbers) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_refers_to_what_exists(page: Path) -> None:
    links = [found for found in LINK.findall(TEXTS[page]) if found[0] != "README.md"]
    within = [(page.name, numbers) for numbers in OWN.findall(TEXTS[page])]
    assert [each for each in links + within if missing(*each)] == []
