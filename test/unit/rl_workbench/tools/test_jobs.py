"""Jobs: trainings that are killed or stopped."""

import contextlib
import os
import select
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import pytest
from support.training.training_runs import assert_same_run
from support.training.workbench_runs import job

from rl_workbench import cli
from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt, search_path
from rl_workbench.tools import jobs as jobs_module
from rl_workbench.tools.jobs import RETRIES, Job, Program, run_here
from rl_workbench.tools.pool import Pool
from rl_workbench.tools.runs import cost_of
from rl_workbench.training import folder as run_folder
from rl_workbench.training.train import PROGRAM

LONGER = {"total_timesteps": 3000, "checkpoint_frequency": 100}
HERE = Program(PROGRAM, search_path())


def pool(at_once: int = 1, interrupt: Interrupt | None = None) -> Pool:
    return Pool(partial(run_here, program=HERE), at_once, interrupt or Interrupt())


def run_all(jobs: list[Job], at_once: int, interrupt: Interrupt | None = None) -> None:
    made = pool(at_once, interrupt)
    made.map(made.run, jobs)


def sleeping(monkeypatch: pytest.MonkeyPatch, program: str = "import time; time.sleep(1000)") -> None:
    """Trainings become another program."""
    words = [sys.executable, "-c", program]
    monkeypatch.setattr(jobs_module, "command", lambda *_: words)


def test_a_folder_that_another_training_holds_is_left_alone(tmp_path: Path) -> None:
    one = job(tmp_path)
    one.folder.mkdir(parents=True)
    with run_folder.held(one.folder):
        assert pool().run(one) == f"a training is running in {one.folder}"
    assert one.folder.exists() and not one.log.exists()


@pytest.mark.slow
def test_a_training_that_is_killed_goes_on_bit_identically(tmp_path: Path, monkeypatch, capsys) -> None:
    killed, other = job(tmp_path / "a", **LONGER), job(tmp_path / "b", **LONGER)
    found: list[int] = []
    finish = jobs_module._finish

    def finishing(process, is_stopped):
        found.append(process.pid)
        return finish(process, is_stopped)

    def is_needed() -> bool:
        if len(found) == 1 and (killed.folder / "last.pt").exists():
            with contextlib.suppress(ProcessLookupError):  # asked once more before the next attempt
                os.kill(found[0], signal.SIGKILL)
        return True

    monkeypatch.setattr(jobs_module, "_finish", finishing)
    assert pool().run(killed, is_needed) == ""
    assert cli.main(jobs_module.command(other, [])) == 0
    assert "seed 0: its process was killed\n" in capsys.readouterr().out
    assert "resuming at step" in killed.log.read_text()
    assert_same_run(killed.folder, other.folder)


def test_one_that_is_killed_again_and_again_is_given_up(tmp_path: Path, monkeypatch) -> None:
    sleeping(monkeypatch, "import os; print(1, flush=True); os.kill(os.getpid(), 9)")
    one = job(tmp_path)
    assert pool().run(one) == f"its process was killed {RETRIES + 1} times"
    assert one.log.read_text() == "1\n" * (RETRIES + 1)


def test_one_that_ends_without_a_result_has_failed(tmp_path: Path, monkeypatch, capsys) -> None:
    """Every training can tell that it is one of several."""
    sleeping(monkeypatch, "import os; print(os.environ['RL_WORKBENCH_JOB'])")
    jobs = [job(tmp_path, seed) for seed in range(2)]
    run_all(jobs, 2)
    said = capsys.readouterr().out
    assert "[2, 2 failed] quick, seed " in said
    assert all(f"ended with exit code 0, see {one.log}: 1\n" in said for one in jobs)


def test_no_further_job_begins_after_ctrl_c(tmp_path: Path, monkeypatch) -> None:
    interrupt = Interrupt()
    sleeping(monkeypatch)
    one, other = jobs = [job(tmp_path, seed) for seed in range(2)]

    def press() -> None:
        while not one.log.exists():
            time.sleep(0.01)
        interrupt.signal = signal.SIGINT

    threading.Thread(target=press).start()
    run_all(jobs, 1, interrupt)
    assert cost_of(one.folder)["cpu_seconds"] >= 0.0
    assert not other.log.exists()


def test_one_that_is_not_needed_any_more_is_stopped(tmp_path: Path, monkeypatch, capsys) -> None:
    sleeping(monkeypatch)
    one = job(tmp_path)
    assert pool().run(one, lambda: not one.log.exists()) == ""
    assert "[1] quick, seed 0: stopped" in capsys.readouterr().out


def test_a_folder_that_cannot_be_written_to_ends_all(tmp_path: Path, monkeypatch) -> None:
    sleeping(monkeypatch)
    (tmp_path / "file").write_text("")
    jobs = [job(tmp_path), Job(tmp_path, "file", 1, ())]
    with pytest.raises(WorkbenchError, match="can't train into"):
        run_all(jobs, 2)


TRAINING = """
import os, signal
signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it saves what it has
os.write(1, f"{os.getpid()}\\n".encode())
while True:
    signal.pause()
"""
WORKER = f"""
import sys
from pathlib import Path
from rl_workbench.tools import jobs

jobs.command = lambda *_: [sys.executable, "-c", {TRAINING!r}]
one = jobs.Job(Path(sys.argv[1]), "run", 0, ())
jobs.attempt(one, jobs.Program((), ""), lambda: False)
"""


def test_a_training_whose_worker_is_killed_does_not_outlive_it(tmp_path: Path) -> None:
    """Otherwise there would be two of them once the worker is replaced."""
    log = tmp_path / "run" / "seed_0.log"
    with subprocess.Popen([sys.executable, "-c", WORKER, str(tmp_path)]) as worker:
        while not (log.exists() and log.read_text().endswith("\n")):
            assert worker.poll() is None
            time.sleep(0.01)
        training = os.pidfd_open(int(log.read_text()))
        worker.kill()
    assert select.select([training], [], [], 60.0)[0]
    os.close(training)
