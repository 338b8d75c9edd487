"""Run folders: new each time, one training in each, nothing left of one that never began."""

from pathlib import Path

import pytest

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.folder import held, opened

PLACE = ("cartpole/Classic-v0", "a/b:c", 7)


def begin(*place: object) -> Path:
    """A folder in which a training has begun."""
    with opened(*place) as folder:
        (folder / "config.json").write_text("")
    return folder


def test_the_default_folder_is_new_each_time(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.time", lambda: 5.0)
    name = "cartpole-Classic-v0__a-b-c__7__5"
    made = [begin("", *PLACE) for _ in range(3)]
    assert made == [tmp_path / "runs" / each for each in (name, f"{name}_2", f"{name}_3")]


def test_a_folder_may_be_named_and_may_be_there_if_it_is_empty(tmp_path: Path) -> None:
    assert begin(str(tmp_path / "some/where"), *PLACE) == tmp_path / "some/where"
    (tmp_path / "empty").mkdir()
    with opened(str(tmp_path / "empty"), *PLACE) as folder:
        assert folder == tmp_path / "empty" and not list(folder.iterdir())
        (folder / "mine").write_text("")


def test_one_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    inside = opened(str(tmp_path / "file" / "run"), *PLACE)
    with pytest.raises(WorkbenchError, match=r"can't write to .*Not a directory"), inside:
        pass


def test_one_that_is_in_use(tmp_path: Path) -> None:
    second = held(tmp_path)
    with held(tmp_path), pytest.raises(WorkbenchError, match="is running in"), second:
        pass
    with held(tmp_path):  # the first one is over
        pass
    with pytest.raises(WorkbenchError, match="is not a run folder"), held(tmp_path / "none"):
        pass
