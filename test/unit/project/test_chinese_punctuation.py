"""The Chinese tutorial has full-width punctuation in its sentences, and only there."""

import re
from pathlib import Path

import pytest

PAGES = sorted(Path(__file__).resolve().parents[3].glob("docs/*.zh.md"))
CHINESE = "\u4e00-\u9fff\u3000-\u303f\uff00-\uffef"
# Beside a Chinese sign; within Latin words and numbers it stays.
ASCII = re.compile(rf"[{CHINESE}][*_]*[,.;:!?()]|[,;:!?()][*_]*[{CHINESE}]|\([a-z]\) ?[{CHINESE}]")
# Code, addresses and formulas are no sentences; each becomes a Latin letter.
NO_SENTENCES = (r"```.*?```", r"(?m)^    .*$", r"`[^`\n]*`", r"\]\([^)\n]*\)", r"\$[^$\n]*\$")


def sentences(text: str) -> str:
    for pattern in NO_SENTENCES:
        text = re.sub(pattern, "]C" if pattern.startswith(r"\]") else "C", text, flags=re.DOTALL)
    return text


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_punctuation_is_full_width(page: Path) -> None:
    text = sentences(page.read_text(encoding="utf-8"))
    assert len(re.findall(rf"[{CHINESE}]", text)) > 500
    assert [text[max(0, m.start() - 20) : m.end() + 20] for m in ASCII.finditer(text)] == []


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("好, 好。", 1),
        ("好，好。", 0),
        ("好(见 a)。", 2),
        ("用 `f(x), y` 和 [好](a.md)，好。", 0),
        ("**好**: 好", 1),
        ("(a) 好", 1),
        ("DQN (2015), 0.5", 0),
    ],
)
def test_what_is_looked_for(text: str, count: int) -> None:
    assert len(ASCII.findall(sentences(text))) == count
