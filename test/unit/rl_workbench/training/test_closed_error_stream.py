"""A training without a standard error, as 2>&- starts it."""

import sys

from rl_workbench.training.progress import Progress


def test_progress_goes_nowhere(monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    shown = Progress(100, "step", 0)
    for count in range(1, 21):
        shown.episode_done([1.0] * count, 1, "5 steps/s", "")
    shown.close()
    assert capsys.readouterr().out == "", "standard output is for results"
