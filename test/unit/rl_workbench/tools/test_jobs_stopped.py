"""Trainings on a node of a cluster that are stopped, or whose worker is killed."""

import os
import select
import subprocess
import sys
from pathlib import Path

import pytest

from rl_workbench.tools.jobs.cluster.attempt import _followed
from rl_workbench.tools.jobs.cluster.nodes import RayNodes

TRAINING = """
import os, signal
signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it saves what it has
os.write(1, b"it runs")
while True:
    signal.pause()
"""
WORKER = f"""
import os, sys
from pathlib import Path
from rl_workbench.tools.jobs.process import TrainingProcess

log = Path(sys.argv[1])
process = TrainingProcess([sys.executable, "-c", {TRAINING!r}], log, {{}}, at_callers_end="KILL")
while not log.read_bytes():
    process.wait(0.01)
print(process._process.pid, flush=True)
process.wait(600.0)
"""


def test_a_training_whose_worker_is_killed_does_not_outlive_it(tmp_path: Path) -> None:
    """Nobody waits for it, and a second one begins elsewhere."""
    command = [sys.executable, "-c", WORKER, str(tmp_path / "log")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as worker:
        assert worker.stdout is not None
        training = os.pidfd_open(int(worker.stdout.readline()))
        worker.kill()
    assert select.select([training], [], [], 60.0)[0]
    os.close(training)


class Saving:
    """A training that takes its time."""

    def __init__(self) -> None:
        self.given: list[float] = []

    def wait(self, seconds: float) -> bool:
        self.given.append(seconds)
        if len(self.given) == 1:
            raise KeyboardInterrupt  # by ray.cancel
        return True

    def stop(self) -> None:
        pass

    def kill(self) -> None:
        pytest.fail()


def test_one_that_is_pruned_has_time_to_draw_its_curve() -> None:
    """Whoever can't wait, as after Ctrl-C, ends the worker by force."""
    training = Saving()
    assert list(_followed(training, None)) == []  # type: ignore[arg-type]
    assert training.given[1] > 10 * RayNodes.time_to_save
