"""Whoever follows a citation of the contract finds the section (docs/contract/README.md)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
CONTRACT = ROOT / "docs" / "contract"
ROOMS = ("src", "test", "companions", "docs", "benchmark", "examples", "scripts", "launch")
SUFFIXES = {"", ".py", ".md", ".launch", ".test", ".xml", ".yaml", ".msg", ".srv", ".action"}
FEWEST = 50

NUMBER = r"\d+(?:\.\d+)?"
NUMBERS = rf"{NUMBER}(?:(?:, | and | to ){NUMBER})*"
CITATION = re.compile(rf"docs/contract/([\w.]+\.md)\b(?: ({NUMBERS}))?")
LINK = re.compile(rf"\]\((\w+\.md)\)(?: ({NUMBERS}))?")  # from one page of the contract to another
OWN = re.compile(rf"\((\d+\.\d+(?:(?:, | and | to ){NUMBER})*)\)")  # within a page
HEADING = re.compile(rf"^#{{2,3}} ({NUMBER}) \S", re.MULTILINE)
# What the citations were before the contract was part of the repository.
OLD = re.compile(
    r"gazebo_api\.md|reference/|\.md,? sections? \d|\(sections? \d|[Cc]ontract: \w+\.md"
)
OLD_IN_CODE = re.compile(r"(?<![\w/])(?:ros_control|ros_utils)\.md")


def read(path: Path) -> str:
    """A file as one line, so that a citation may be broken; comments' leaders are left out."""
    return re.sub(r"\s*\n\s*(?:# )?", " ", path.read_text(encoding="utf-8"))


def files() -> Iterator[Path]:
    """All text files of the rooms but this one, which has the old forms in it."""
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*")):
            wanted = path.is_file() and path.suffix in SUFFIXES and "__pycache__" not in path.parts
            if wanted and path != Path(__file__).resolve():
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


def test_the_citations_are_found() -> None:
    assert len([each for each in CITED if each[2]]) >= FEWEST


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_refers_to_what_exists(page: Path) -> None:
    links = [found for found in LINK.findall(TEXTS[page]) if found[0] != "README.md"]
    within = [(page.name, numbers) for numbers in OWN.findall(TEXTS[page])]
    assert [each for each in links + within if missing(*each)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_number_is_used_once(page: Path) -> None:
    found = sections(page)
    assert sorted(set(found)) == sorted(found)
    assert found or page.name == "README.md"


def test_no_citation_of_the_old_form() -> None:
    found = {}
    for path, text in TEXTS.items():
        old = OLD.findall(text)
        if not path.is_relative_to(ROOT / "docs"):  # there ros_utils.md is a page
            old += OLD_IN_CODE.findall(text)
        if old:
            found[str(path.relative_to(ROOT))] = old
    assert found == {}


def test_ranges_lists_and_gaps() -> None:
    assert expanded("2.18 and 2.19") == ["2.18", "2.19"]
    assert expanded("1.9 to 1.11, 3 and 4.2") == ["1.9", "1.10", "1.11", "3", "4.2"]
    assert missing("gazebo.md", "2.20 to 2.23") == ["2.22", "2.23"]
    assert missing("nobody.md", "1") == ["nobody.md"]
    with pytest.raises(ValueError, match="different chapters"):
        expanded("1.2 to 2.3")
