#!/usr/bin/env python3
"""Check the documentation: its links, and the files that it names.

For all Markdown files of the repository:
- every relative link leads to a file or folder, and its #anchor to a heading;
- every page of docs/ can be reached from README.md;
- every path in `backticks` or in a block of code that starts in a folder of ours is there. Parts in
  CAPITALS or <brackets>, and * ? {}, stand for names. CHANGELOG.md may name what is gone.

Prints one line for each fault, and exits with 1 if there are any.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[1]
HISTORY = "CHANGELOG.md"
RESULTS = ("runs", "models")  # folders that trainings make, as in .gitignore
BESIDE = ".."  # the reader's own folders
BLOCK = re.compile(
    r"^ {0,3}(?P<fence>```|~~~)(?P<fenced>.*?)^ {0,3}(?P=fence)[^\n]*$"
    r"|(?:\A|(?<=\n\n))(?P<indented>(?:(?: {4}|\t)[^\n]*\n|\n)+)",
    re.MULTILINE | re.DOTALL,
)
CODE = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"!?\[[^\]\[]*(?:\[[^\]]*\][^\]\[]*)*\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)")
HEADING = re.compile(r"^#{1,6} +(.+?)(?: +#+)? *$", re.MULTILINE)
SCHEME = re.compile(r"^[a-z][a-z0-9+.-]*:", re.IGNORECASE)
PLACEHOLDER = re.compile(r"[<>*?{}…$]|\.\.\.|\b[A-Z]{2,}\b")


class Page:
    """A Markdown file, as far as links count."""

    def __init__(self, path: Path) -> None:
        self.path = path
        text = path.read_text(encoding="utf-8")
        blocks = [match["fenced"] or match["indented"] or "" for match in BLOCK.finditer(text)]
        text = BLOCK.sub("", text)
        self.code = blocks + CODE.findall(text)
        self.anchors = anchors(HEADING.findall(text))
        self.links = LINK.findall(CODE.sub("", text))

    def targets(self) -> Iterator[tuple[str, Path, str]]:
        """Yield each relative link, the file it leads to, and its anchor."""
        for link in self.links:
            if not SCHEME.match(link):
                place, _, anchor = unquote(link).partition("#")
                yield link, (self.path.parent / place).resolve() if place else self.path, anchor


def anchors(headings: list[str]) -> set[str]:
    """The anchors that a Git host gives to headings: lower case, - for blanks, no other signs."""
    found: set[str] = set()
    for heading in headings:
        text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        plain = re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", "-")
        anchor, number = plain, 0
        while anchor in found:
            number += 1
            anchor = f"{plain}-{number}"
        found.add(anchor)
    return found


def faults(root: Path) -> Iterator[str]:
    """Yield what is wrong with the documentation below a folder."""
    pages = {path: Page(path) for path in markdown_files(root)}
    for path, page in pages.items():
        name = path.relative_to(root)
        for link, target, anchor in page.targets():
            if not target.is_relative_to(root) or not target.exists():
                yield f"{name}: ({link}) leads nowhere"
            elif anchor and (target not in pages or anchor not in pages[target].anchors):
                yield f"{name}: ({link}) leads to no heading"
        if name.name != HISTORY:
            for place in sorted({place for code in page.code for place in paths(code, root)}):
                if not (root / place).exists():
                    yield f"{name}: `{place}` isn't there"
    for path in sorted(pages.keys() - reached(root / "README.md", pages)):
        if path.is_relative_to(root / "docs"):
            yield f"{path.relative_to(root)}: no links lead there from README.md"


def markdown_files(root: Path) -> list[Path]:
    """All Markdown files but those in hidden folders, which aren't ours to check."""
    tops = [path for path in root.iterdir() if not path.name.startswith(".")]
    found = (path for top in tops for path in (top.rglob("*.md") if top.is_dir() else [top]))
    return sorted(path for path in found if path.suffix == ".md")


def paths(code: str, root: Path) -> Iterator[str]:
    """Yield the words of code that name a file or folder of the repository."""
    for word in code.split():
        place = word.rstrip(".,;:)").split("::")[0]
        top, slash, _ = place.partition("/")
        named = not PLACEHOLDER.search(place)
        if slash and top and top not in (*RESULTS, BESIDE) and named and (root / top).is_dir():
            yield place


def reached(start: Path, pages: dict[Path, Page]) -> set[Path]:
    """The pages that links lead to, from one page on."""
    found, new = {start}, [start]
    while new:
        for _, target, _ in pages[new.pop()].targets():
            if target in pages and target not in found:
                found.add(target)
                new.append(target)
    return found


def main() -> int:
    """Check this repository."""
    found = list(faults(ROOT))
    for fault in found:
        print(fault)
    if not found:
        print(f"{len(markdown_files(ROOT))} pages: all links and paths lead somewhere")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
