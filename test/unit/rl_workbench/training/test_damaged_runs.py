"""Folders of trainings that somebody damaged, moved or changed: told in one line, or made good."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from support.training import training_runs as runs
from support.training.training_runs import InterruptAfter, checkpoint, record, resume, rows, summary

from rl_workbench.errors import WorkbenchError

pytestmark = pytest.mark.slow

SHORT = {"total_timesteps": 120, "eval_frequency": 0}  # as those of `short` and `stopped`


@pytest.mark.parametrize("name", runs.ALL)
def test_a_damaged_checkpoint_gives_way(whole, times, tmp_path, capsys, name: str) -> None:
    run = runs.train(tmp_path / "run", name, InterruptAfter(round(0.9 * times(name))))
    newest = run / "last.pt"
    content = bytearray(newest.read_bytes())
    for place in range(len(content) // 2, len(content) // 2 + 100):
        content[place] ^= 1  # in the middle of some tensor: torch alone would not see it
    newest.write_bytes(content)  # under both of its names
    resume(run)
    told = capsys.readouterr().out
    assert f"{newest} is damaged" in told and "looking for an earlier one" in told
    assert summary(run)["complete"]
    if name in runs.EXACT:
        runs.assert_same_run(whole(name), run)


@pytest.mark.parametrize("damage", [lambda path: path.write_bytes(b""), Path.unlink])
def test_without_any_good_checkpoint(stopped: Path, damage: Callable[[Path], object]) -> None:
    for path in set(stopped.rglob("*.pt")):
        damage(path)
    if damage is Path.unlink:
        assert summary(resume(stopped))["complete"], "as one that was killed before its first"
        return
    with pytest.raises(WorkbenchError, match="holds no checkpoint to continue from"):
        resume(stopped)


def change_record(run: Path, part: str, name: str, value: object) -> None:
    content = record(run)
    content[part][name] = value
    (run / "config.json").write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("part", "name", "value", "words"),
    [("hyperparameters", "gamma", 0.5, "gamma 0.5, the checkpoint 0.99"),
     ("hyperparameters", "hidden_sizes", [32], "hidden_sizes [32], the checkpoint [16, 16]"),
     ("run", "seed", 9, "seed 9, the checkpoint 3")],
)  # fmt: skip
def test_a_record_that_somebody_changed_is_refused(stopped, part, name, value, words) -> None:
    change_record(stopped, part, name, value)
    line = runs.failure(lambda: resume(stopped))
    assert f"config.json says {words}; a resumed training keeps" in line


def test_other_versions_are_told(stopped: Path, capsys) -> None:
    change_record(stopped, "versions", "torch", "1.0")
    resume(stopped)
    assert f"torch 1.0 is now {torch.__version__}: the bits may differ" in capsys.readouterr().out
    assert record(stopped)["versions"]["torch"] == "1.0", "those that it began with"


@pytest.mark.parametrize(
    "content",
    ['{"algorithm": "dqn"}', "[]", "{", "", '{"algorithm": "dqn", "run": [1], "dqn": {}}',
     '{"algorithm": "dqn", "run": [1], "hyperparameters": {}}',
     '{"algorithm": 3, "run": {}, "hyperparameters": {}}', "[" * 100_000,
     '{"algorithm": "dqn", "run": {"seed": "x"}, "hyperparameters": {}}'],
)  # fmt: skip
def test_a_damaged_record_is_one_line(stopped: Path, content: str) -> None:
    (stopped / "config.json").write_text(content)
    assert str(stopped / "config.json") in runs.failure(lambda: resume(stopped))


@pytest.mark.parametrize("left", [None, 0, 10, 300])
def test_figures_that_were_lost_cost_nothing_else(short, tmp_path, capsys, left) -> None:
    run = runs.train(tmp_path / "run", "dqn", InterruptAfter(80), **SHORT)
    path = run / "scalars.csv"
    if left is None:
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:left])
    resume(run)
    assert "lacks rows that it had" in capsys.readouterr().out
    runs.assert_same(checkpoint(run)["q_net"], checkpoint(short)["q_net"])
    assert set(rows(run)) < set(rows(short)) and rows(run)
    runs.assert_no_doubles(run)


def test_a_moved_run_goes_on_where_it_lies(short: Path, stopped: Path, tmp_path: Path) -> None:
    moved = resume(stopped.rename(tmp_path / "elsewhere"))
    assert rows(moved) == rows(short)
    assert not stopped.exists()
