"""The programs of docs/snapshots.md run one after the other, as a reader would type them."""

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[3] / "docs/snapshots.md"


def test_its_programs_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    known = {}
    text = PAGE.read_text(encoding="utf-8")
    for program in re.findall(r"^```python\n(.*?)^```", text, re.M | re.S):
        exec(program, known)
    assert repr(known["first"]) == repr(known["again"]) and (tmp_path / "hard.snapshot").exists()
    starts = {known["env"].reset(seed=seed)[0].tobytes() for seed in range(8)}
    assert len(starts) > 1
