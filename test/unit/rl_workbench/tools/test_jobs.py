"""Jobs: trainings that are killed, stopped or lost, and how the list tells it."""

import contextlib
import json
import os
import re
import select
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from support.training import workbench_runs
from support.training.training_runs import assert_same_run
from support.training.workbench_runs import job

from rl_workbench import cli
from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt, search_path
from rl_workbench.tools import job as job_module
from rl_workbench.tools.job import Ending, Job, Program, StopWithin, run_here, steps_of
from rl_workbench.tools.jobs import JobPool, read_jobs
from rl_workbench.tools.runs import cost_file, cost_of
from rl_workbench.training import folder as run_folder
from rl_workbench.training.train import PROGRAM

LONGER = {"total_timesteps": 3000, "checkpoint_frequency": 100}
HERE = Program(PROGRAM, search_path())


def pool(folder: Path, jobs: list[Job], at_once: int = 1, interrupt: Any = None) -> JobPool:
    folder.mkdir(exist_ok=True)
    run = partial(run_here, program=HERE, since=time.time())
    return JobPool(folder, run, at_once, interrupt or Interrupt(), jobs)


def sleeping(monkeypatch: Any, program: str = "import time; time.sleep(1000)") -> None:
    """Trainings become another program."""
    words = [sys.executable, "-c", program]
    monkeypatch.setattr(job_module, "command", lambda *_: words)


def test_a_training_that_outlived_its_command_is_left_alone(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(job_module, "MAX_ATTEMPTS", 2)
    one = job(tmp_path)
    one.folder.mkdir()
    with run_folder.held(one.folder):
        failure = pool(tmp_path, [one]).run(one)
    assert f"lost, retrying: a training is running in {one.folder}" in capsys.readouterr().out
    assert "without progress: a training is running in" in failure
    assert one.folder.exists() and not one.log.exists()


@pytest.mark.slow
def test_a_training_that_is_killed_goes_on_bit_identically(tmp_path: Path, capsys) -> None:
    killed, other = job(tmp_path / "a", **LONGER), job(tmp_path / "b", **LONGER)
    found: list[int] = []
    start = job_module._start

    def started(*arguments):
        process = start(*arguments)
        found.append(process.pid)
        return process

    def is_needed() -> bool:
        if len(found) == 1 and steps_of(killed.folder)[0] >= 300:
            with contextlib.suppress(ProcessLookupError):  # asked once more before the next attempt
                os.kill(found[0], signal.SIGKILL)
        return True

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(job_module, "_start", started)
        assert pool(tmp_path, [killed]).run(killed, is_needed) == ""
    assert cli.main(["train", f"--run-dir={other.folder}", *other.flags]) == 0
    assert "lost, retrying: its process was killed" in capsys.readouterr().out
    assert len(cost_of(killed.folder)["spans"]) == 2
    assert_same_run(killed.folder, other.folder)


def test_one_that_is_killed_again_and_again_is_given_up(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(job_module, "MAX_PAUSE", 0.0)
    sleeping(monkeypatch, "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    one = job(tmp_path)
    failure = pool(tmp_path, [one]).run(one)
    assert failure == "given up after 8 attempts without progress: its process was killed"
    assert len(cost_of(one.folder)["spans"]) == 8
    (status,) = read_jobs(tmp_path)
    assert (status.state, status.attempts) == ("failed", 8)


def test_one_that_ends_without_a_result_has_failed(tmp_path: Path, monkeypatch) -> None:
    """Every training can tell that it is one of several."""
    sleeping(monkeypatch, "import os; print(os.environ['RL_WORKBENCH_JOB'])")
    jobs = [job(tmp_path, seed) for seed in range(2)]
    pool(tmp_path, jobs, 2).run_all(jobs)
    assert [one.log.read_text() for one in jobs] == ["1\n", "1\n"]
    for status in read_jobs(tmp_path):
        assert status.state == "failed" and "ended with exit code 0" in status.line


def test_no_further_job_begins_after_ctrl_c(tmp_path: Path, monkeypatch) -> None:
    interrupt = Interrupt()
    sleeping(monkeypatch)
    one, other = jobs = [job(tmp_path, seed) for seed in range(2)]

    def press() -> None:
        while not one.log.exists():
            time.sleep(0.01)
        interrupt.signal = signal.SIGINT

    threading.Thread(target=press).start()
    pool(tmp_path, jobs, 1, interrupt).run_all(jobs)
    assert cost_of(one.folder)["cpu_seconds"] >= 0.0
    assert not other.log.exists() and not cost_of(other.folder)


def test_one_that_is_not_needed_any_more_is_stopped(tmp_path: Path, monkeypatch) -> None:
    sleeping(monkeypatch)
    one = job(tmp_path)
    assert pool(tmp_path, [one]).run(one, lambda: not one.log.exists()) == ""
    (status,) = read_jobs(tmp_path)
    assert (status.state, status.line) == ("done", "stopped early: its result is no longer needed")


def test_a_folder_that_cannot_be_written_to_ends_all(tmp_path: Path, monkeypatch) -> None:
    sleeping(monkeypatch)
    (tmp_path / "file").write_text("")
    jobs = [job(tmp_path), Job("second", tmp_path / "file" / "run", ())]
    with pytest.raises(WorkbenchError, match="can't train into"):
        pool(tmp_path, jobs, 2).run_all(jobs)


TRAINING = """
import os, signal
signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it saves what it has
os.write(1, f"{os.getpid()}\\n".encode())
while True:
    signal.pause()
"""
WORKER = f"""
import sys, time
from pathlib import Path
from typing import Any
from rl_workbench.tools import job

job.command = lambda *_: [sys.executable, "-c", {TRAINING!r}]
one = job.Job("one", Path(sys.argv[1]) / "run", ())
job.run_attempt(one, job.Program((), ""), lambda: None, time.time(), death_signal="KILL")
"""


def test_a_training_whose_worker_is_killed_does_not_outlive_it(tmp_path: Path) -> None:
    """Otherwise there would be two of them once the worker is replaced."""
    log = tmp_path / "run.log"
    with subprocess.Popen([sys.executable, "-c", WORKER, str(tmp_path)]) as worker:
        while not (log.exists() and log.read_text().endswith("\n")):
            assert worker.poll() is None
            time.sleep(0.01)
        training = os.pidfd_open(int(log.read_text()))
        worker.kill()
    assert select.select([training], [], [], 60.0)[0]
    os.close(training)


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


def test_jobs_are_listed_from_files_alone(tmp_path: Path, capsys) -> None:
    every = jobs(tmp_path)
    began = time.time() - 3600.0
    cost_file(every[1].folder).write_text(
        json.dumps({"node": "10.0.0.8", "spans": [[1.0, 2.0], [began, began]]})
    )

    def run(job: Job, stop_within: StopWithin, say) -> Ending:
        if job is every[2]:
            job.log.write_text("the loss is nan\n")
            return Ending(1)
        with run_folder.held(tmp_path):
            assert cli.main(["jobs", str(tmp_path)]) == 0
        return Ending()

    made = JobPool(tmp_path, run, 1, Interrupt(), every)
    made.run(every[2])
    made.run(every[1])
    lines = [line for line in capsys.readouterr().out.splitlines() if not line.startswith("[")]
    assert lines[0].split()[:2] == ["done", "done"]
    assert "300 steps  in 1.5 s, best evaluation 9.0 at step 200" in lines[0]
    assert lines[1].split()[0] == "running" and "30 of 500 steps" in lines[1]
    assert re.search("for 1:00:.. on 10.0.0.8  attempt 2.*Episode 20$", lines[1])
    assert lines[2].endswith("the loss is nan") and lines[3].split()[0] == "waiting"
    assert lines[4] == "4 jobs: 1 done, 1 running, 1 failed, 1 waiting"


def test_what_a_command_that_was_killed_has_left_is_stopped_and_then_waits(tmp_path: Path) -> None:
    every = jobs(tmp_path)
    content = {"jobs": [{"name": "running", "folder": "running", "state": "running", "note": ""}]}
    (tmp_path / "jobs.json").write_text(json.dumps(content))
    summary = {"complete": False, "interrupted": True, "steps": 30, "seconds": 1.5, "best": None}
    (every[1].folder / "summary.json").write_text(json.dumps(summary))
    (stopped,) = read_jobs(tmp_path)
    assert (stopped.state, stopped.line) == ("stopped", "in 1.5 s, no evaluation")
    pool(tmp_path, [])
    with run_folder.held(tmp_path):
        assert [each.state for each in read_jobs(tmp_path)] == ["waiting"]


def test_jobs_of_earlier_commands_stay_in_the_list(tmp_path: Path, monkeypatch) -> None:
    sleeping(monkeypatch, "")
    for name in ("one", "two", "one"):
        pool(tmp_path, []).run(Job(name, tmp_path / name, ()))
    found = [(each.name, each.state, each.attempts) for each in read_jobs(tmp_path)]
    assert found == [("one", "failed", 2), ("two", "failed", 1)]
