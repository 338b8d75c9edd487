"""docs/errors.md explains texts that the software prints, and not those of older versions."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
HEADING = re.compile(r"^### (.+)$", re.MULTILINE)
TEXTS = [text.strip("`") for text in HEADING.findall((ROOT / "docs/errors.md").read_text("utf-8"))]


@pytest.fixture(scope="module")
def source() -> str:
    files = (ROOT / "src").rglob("*.py")
    return "\n".join(each.read_text("utf-8") for each in files)


@pytest.mark.parametrize("text", TEXTS)
def test_the_software_prints_it(text: str, source: str) -> None:
    assert text in re.sub(r'"\s*\n\s*f?"', "", source)  # literals that go on in the next line
