"""Jobs on this machine: one after the other, after a kill, after Ctrl-C."""

import os
import signal
import sys
from pathlib import Path

import pytest
from support.training.training_runs import assert_same_run
from support.training.workbench_runs import job

from rl_workbench.starting import Interrupt
from rl_workbench.tools.benchmark.suites import (
    make_variant,
    training_flags,
)
from rl_workbench.tools.jobs import machines, runner
from rl_workbench.tools.jobs.job import Job, command
from rl_workbench.tools.jobs.machines import ThisMachine
from rl_workbench.tools.jobs.runner import Runner, Watch
from rl_workbench.tools.jobs.states import steps_of
from rl_workbench.tools.runs.runs import cost_of
from rl_workbench.training import folder as run_folder
from rl_workbench.training.train import PROGRAM

pytestmark = pytest.mark.usefixtures("signals")

LONGER = {"total_timesteps": 3000, "checkpoint_frequency": 100}


class Told(Watch):
    """What a runner tells of its jobs."""

    def __init__(self) -> None:
        self.losses: list[str] = []
        self.endings: dict[str, str] = {}

    def lost(self, job: Job, reason: str) -> None:
        self.losses.append(reason)

    def ended(self, job: Job, failure: str) -> None:
        self.endings[job.name] = failure


def run(jobs: list[Job], at_once: int = 1, interrupt: Interrupt | None = None) -> Told:
    told = Told()
    Runner(ThisMachine(at_once, PROGRAM), told).run(jobs, interrupt or Interrupt())
    return told


def test_a_training_that_outlived_its_benchmark_is_left_alone(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(runner, "MOST_LOST", 2)
    one = job(tmp_path)
    one.folder.mkdir()
    with run_folder.held(one.folder):
        told = run([one])
    assert told.losses == [f"a training is running in {one.folder}"]
    assert "given up after 2 attempts" in told.endings[one.name]
    assert one.folder.exists() and not one.log.exists()


@pytest.mark.slow
def test_a_training_that_is_killed_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    killed, other = job(tmp_path / "a", **LONGER), job(tmp_path / "b", **LONGER)
    machine = ThisMachine(1, PROGRAM)

    class Killing(Told):
        def progressed(self, job: Job, node: str) -> None:
            if job is killed and not self.losses and steps_of(job.folder)[0] >= 300:
                os.kill(machine._running[job]._process.pid, signal.SIGKILL)

    told = Killing()
    Runner(machine, told).run([killed, other], Interrupt())
    assert told.losses == ["its process was killed"]
    assert told.endings == {killed.name: "", other.name: ""}
    assert len(cost_of(killed.folder)["spans"]) == 2
    assert_same_run(killed.folder, other.folder)


def test_every_training_has_a_master_of_its_own(tmp_path: Path, monkeypatch) -> None:
    program = "import os; print(os.environ['ROS_MASTER_URI'])"
    monkeypatch.setattr(machines, "command", lambda *_: [sys.executable, "-c", program])
    jobs = [job(tmp_path, seed) for seed in range(2)]
    told = run(jobs, 2)
    masters = {one.log.read_text().strip() for one in jobs}
    assert len(masters) == 2 and all(each.startswith("http://127.0.0.1:") for each in masters)
    assert all("ended with exit code 0" in told.endings[one.name] for one in jobs), (
        "it left nothing"
    )


def test_no_further_job_begins_after_ctrl_c(tmp_path: Path, monkeypatch) -> None:
    interrupt, genuine = Interrupt(), ThisMachine.wait

    def waited(*arguments: object) -> object:
        result = genuine(*arguments)
        interrupt.signal = signal.SIGINT
        return result

    monkeypatch.setattr(machines, "command", lambda *_: ["sleep", "1000"])
    monkeypatch.setattr(ThisMachine, "wait", waited)
    one, other = (job(tmp_path, seed) for seed in range(2))
    run([one, other], 1, interrupt)
    assert cost_of(one.folder)["cpu_seconds"] >= 0.0
    assert not other.log.exists() and not cost_of(other.folder)


def test_the_training_is_told_all_of_its_options(tmp_path: Path) -> None:
    variant = make_variant("t", "wide", {"preset": "tutorial", "hidden_sizes": [64, 32]})
    flags = tuple(training_flags(variant, 1))
    told = command(Job("wide", tmp_path / "run", flags), tmp_path / "run", PROGRAM)[len(PROGRAM) :]
    assert told[:4] == ["train", f"--run-dir={tmp_path / 'run'}", "--algo", "dqn"]
    assert {"--preset=tutorial", "--seed=1", "--exp-name=wide"} <= set(told)
    assert told[told.index("--params") + 1 :] == ["hidden_sizes=[64,32]"]
