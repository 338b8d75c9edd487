"""Run folders: new each time, one training in each, nothing left of one that never began."""

import fcntl
import multiprocessing
import os
from pathlib import Path

import pytest

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.folder import held, opened

PLACE = ("cartpole/Classic-v0", "a/b:c", 7)
RACES, RACERS = 20, 6


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


def test_one_that_holds_something_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "old").write_text("")
    with pytest.raises(WorkbenchError, match="isn't empty"), opened(str(tmp_path), *PLACE):
        pass
    assert (tmp_path / "old").exists()


def test_a_training_that_cannot_begin_leaves_none_behind(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="no such"), opened(str(tmp_path / "run"), *PLACE):
        raise WorkbenchError("no such environment")
    assert not (tmp_path / "run").exists()


def test_one_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    inside = opened(str(tmp_path / "file" / "run"), *PLACE)
    with pytest.raises(WorkbenchError, match=r"can't write to .*Not a directory"), inside:
        pass


@pytest.mark.skipif(os.geteuid() != 0, reason="/proc can't be written to by anybody")
def test_one_that_cannot_be_written_to() -> None:
    with pytest.raises(WorkbenchError, match="can't write to"), opened("/proc/run", *PLACE):
        pass


def test_one_that_is_in_use(tmp_path: Path) -> None:
    second = held(tmp_path)
    with held(tmp_path), pytest.raises(WorkbenchError, match="is running in"), second:
        pass
    with held(tmp_path):  # the first one is over
        pass
    with pytest.raises(WorkbenchError, match="is no run folder"), held(tmp_path / "none"):
        pass


@pytest.mark.parametrize("again", [False, True])
def test_one_that_its_last_holder_removes_meanwhile(
    tmp_path: Path, monkeypatch, again: bool
) -> None:
    def removed(descriptor: int, how: int) -> None:
        (tmp_path / "run").rmdir()
        if again:  # somebody else's
            (tmp_path / "run").mkdir()
        lock(descriptor, how)

    lock = fcntl.flock
    monkeypatch.setattr(fcntl, "flock", removed)
    (tmp_path / "run").mkdir()
    with pytest.raises(WorkbenchError, match="is no run folder"), held(tmp_path / "run"):
        pass
    assert (tmp_path / "run").exists() == again


def race(barriers: list, folder: Path, index: int, results: multiprocessing.Queue) -> None:
    """Opens each folder at once with others.

    Racers of odd numbers begin, and hold theirs until all others have tried; those of even
    numbers can't begin, and give it up at once.
    """
    for number, (start, tried) in enumerate(barriers):
        start.wait()
        try:
            with opened(str(folder / str(number)), *PLACE) as mine:
                if index % 2 == 0:
                    raise WorkbenchError("can't begin")
                (mine / "config.json").write_text(str(index))
                tried.wait()
                told = "began"
        except WorkbenchError as error:
            told = str(error)
            tried.wait()
        results.put((number, index, told))


@pytest.mark.slow
def test_several_trainings_started_into_one_folder_at_once(tmp_path: Path) -> None:
    """At most one begins; the others are told, and take nothing away from it."""
    processes = multiprocessing.get_context("fork")
    barriers = [tuple(processes.Barrier(RACERS, timeout=60) for _ in "ab") for _ in range(RACES)]
    results = processes.Queue()
    racers = [
        processes.Process(target=race, args=(barriers, tmp_path, index, results))
        for index in range(RACERS)
    ]
    for each in racers:
        each.start()
    told = [results.get(timeout=60) for _ in range(RACES * RACERS)]
    for each in racers:
        each.join(60)
        assert each.exitcode == 0
    began = {number: str(index) for number, index, text in told if text == "began"}
    assert len(began) == sum(text == "began" for *_, text in told), "one each"
    assert began, "some did"
    found = {int(path.name): (path / "config.json").read_text() for path in tmp_path.iterdir()}
    assert found == began
    refusals = ("began", "can't begin", "is running in", "is no run folder")
    assert all(any(each in text for each in refusals) for *_, text in told)
