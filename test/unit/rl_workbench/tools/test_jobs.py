"""Jobs without Ray: folders on their way between machines, how they are getting on, what is lost."""

import json
import os
import re
from pathlib import Path

import pytest
from support.training import workbench_runs

from rl_workbench import cli
from rl_workbench.tools.jobs.cluster import parcels
from rl_workbench.tools.jobs.cluster.parcels import Inbox, Outbox, Parcel
from rl_workbench.tools.jobs.job import Job
from rl_workbench.tools.jobs.ledger import Ledger, settle
from rl_workbench.tools.jobs.states import read_states
from rl_workbench.training import folder as run_folder

pytestmark = pytest.mark.usefixtures("signals")

EVENTS = "events.out.tfevents.1.host.2"


class Node:
    """A run's folder as a training leaves it while it learns: rows, then a checkpoint that counts on them."""

    def __init__(self, place: Path) -> None:
        self.folder, self.log = place / "run", place / "run.log"
        (self.folder / "checkpoints").mkdir(parents=True)
        (self.folder / "config.json").write_text("{}")
        (self.folder / "scalars.csv").write_text("step,tag\n")
        (self.folder / ".half.pt.x1").write_text("being written")

    def learn(self, step: int, best: bool = False) -> None:
        with (self.folder / "scalars.csv").open("a") as table, self.log.open("a") as log:
            table.write(f"{step},a\n" * 50)
            log.write(f"at step {step}\n")
        self.save(step, ("best.pt", "last.pt") if best else ("last.pt",))

    def save(self, step: int, names: tuple[str, ...]) -> None:
        length = (self.folder / "scalars.csv").stat().st_size
        path = self.folder / f"checkpoints/step_{step}.pt"
        path.write_text(json.dumps({"step": step, "log_bytes": length, "weights": "w" * 100}))
        for name in names:
            parcels.give_name(path, self.folder / name)


def tree(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in files
        if not path.name.startswith(".")
    }


def check_resumable(home: Path) -> None:
    """Wherever it breaks off: what is called a checkpoint is whole, and so is its table."""
    if (home / "last.pt").exists():
        checkpoint = json.loads((home / "last.pt").read_text())
        assert checkpoint["weights"] == "w" * 100
        assert (home / "scalars.csv").stat().st_size >= checkpoint["log_bytes"]


def carry(sent: Outbox, inbox: Inbox, home: Path) -> list[Parcel]:
    all_of_it = []
    for parcel in sent.pack():
        inbox.take(parcel)
        check_resumable(home)
        all_of_it.append(parcel)
    return all_of_it


def test_a_folder_comes_home_as_it_changes(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(parcels, "PIECE", 64)
    node, home, log = Node(tmp_path / "node"), tmp_path / "home/run", tmp_path / "home/run.log"
    log.parent.mkdir()
    log.write_text("an earlier attempt\n")
    outbox, inbox = Outbox(node.folder, node.log), Inbox(home, log)
    (node.folder / EVENTS).write_text("one")
    node.learn(100)
    carry(outbox, inbox, home)
    assert tree(home) == tree(node.folder)
    assert os.path.samefile(home / "last.pt", home / "checkpoints/step_100.pt"), "it came once"
    assert not outbox.has_new_files() and not list(outbox.pack())

    node.learn(200, best=True)
    (node.folder / "checkpoints/step_100.pt").unlink()
    assert outbox.has_new_files()
    content = sum(
        len(each.content) for each in carry(outbox, inbox, home) if hasattr(each, "content")
    )
    table = (node.folder / "scalars.csv").stat().st_size
    assert content < table + 200, "of what grows, only what is new"
    assert tree(home) == tree(node.folder)
    assert log.read_text() == "an earlier attempt\nat step 100\nat step 200\n"

    # Resumed, a training cuts its table back to the checkpoint, and begins another file for TensorBoard.
    with (node.folder / "scalars.csv").open("a") as table_file:
        table_file.write("210,b\n" * 20)
    carry(outbox, inbox, home)
    os.truncate(node.folder / "scalars.csv", table)
    (node.folder / EVENTS).unlink()
    (node.folder / "events.out.tfevents.9.host.2").write_text("two")
    node.learn(300)
    carry(outbox, inbox, home)
    assert tree(home) == tree(node.folder)


def test_a_file_that_is_replaced_on_its_way_arrives_as_it_was(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(parcels, "PIECE", 64)
    node, home = Node(tmp_path / "node"), tmp_path / "home"
    outbox, inbox = Outbox(node.folder, node.log), Inbox(home, tmp_path / "log")
    node.learn(100)
    for number, parcel in enumerate(outbox.pack()):
        if number == 8:
            node.learn(200)
            (node.folder / "checkpoints/step_100.pt").unlink()
        inbox.take(parcel)
        check_resumable(home)
    carry(outbox, inbox, home)
    assert tree(home) == tree(node.folder)


def test_a_half_done_run_travels_to_another_node(tmp_path: Path) -> None:
    home = Node(tmp_path / "home")
    home.learn(100)
    there = tmp_path / "node/run"
    carry(Outbox(home.folder, log=None), Inbox(there, tmp_path / "log"), there)
    assert tree(there) == tree(home.folder)


def jobs(folder: Path) -> list[Job]:
    names = ("done", "running", "failed", "waiting")
    found = [Job(name, folder / name, ()) for name in names]
    workbench_runs.record(found[0].folder, [20.0] * 3)
    summary = {"complete": True, "steps": 300, "seconds": 1.5, "best": [200, 9.0]}
    (found[0].folder / "summary.json").write_text(json.dumps(summary))
    workbench_runs.record(found[1].folder, [20.0] * 3, total_timesteps=500)
    with (found[1].folder / "scalars.csv").open("a") as table:
        table.write("2,Reward,20.0,0\n")  # of REINFORCE's document, over episodes
    found[1].log.write_text("Episode 20\n\n")
    return found


def test_jobs_are_listed_from_files_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    every = jobs(tmp_path)
    ledger = Ledger(tmp_path, every)
    ledger.began(every[1], "10.0.0.7")
    ledger._entries[every[1]].began -= 3600.0
    ledger.ended(every[2], "ended with exit code 1: the loss is nan")
    with run_folder.held(tmp_path):
        ledger.progressed(every[1], "10.0.0.8")  # written, since something has changed
        assert [each.state for each in read_states(tmp_path)] != []
    ledger._write()
    with run_folder.held(tmp_path):
        assert cli.main(["jobs", str(tmp_path), f"--json={tmp_path / 'out.json'}"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert (
        lines[0].split()[:2] == ["done", "done"]
        and "300 steps  in 1.5 s, best evaluation 9.0 at step 200" in lines[0]
    )
    assert lines[1].split()[0] == "running" and "30 of 500 steps" in lines[1]
    assert re.search("for 1:00:.. on 10.0.0.8", lines[1]) and lines[1].endswith("Episode 20")
    assert lines[2].endswith("the loss is nan") and lines[3].split()[0] == "waiting"
    assert lines[4] == "4 jobs: 1 done, 1 running, 1 failed, 1 waiting"
    assert json.loads((tmp_path / "out.json").read_text())[1]["step"] == 30

    # Whoever ran them was killed.
    summary = {"complete": False, "interrupted": True, "steps": 30, "seconds": 1.5, "best": None}
    (every[1].folder / "summary.json").write_text(json.dumps(summary))
    stopped = read_states(tmp_path)[1]
    assert (stopped.state, stopped.line) == ("stopped", "in 1.5 s, no evaluation")
    settle(tmp_path)
    with run_folder.held(tmp_path):
        assert [each.state for each in read_states(tmp_path)][1] == "waiting"
        ledger.lost(every[1], "its node died")
        ledger._write()
        assert read_states(tmp_path)[1].line == "lost, and tried again: its node died"


def test_where_there_are_no_jobs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["jobs", str(tmp_path)]) == 1
    assert "has no jobs: jobs.json lies in the folder of a benchmark" in capsys.readouterr().err
    (tmp_path / "jobs.json").write_text('{"host": "a", "jobs": [{"nam": 1}]}')
    assert cli.main(["jobs", str(tmp_path)]) == 1
    assert "isn't a list of jobs" in capsys.readouterr().err
