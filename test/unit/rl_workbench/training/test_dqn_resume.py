"""The command line, killed at random moments: resumed, it ends where it would have ended."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from dqn_runs import SMALL, assert_same_run, flags, without_doubles

pytestmark = pytest.mark.slow

OPTIONS = SMALL | {"total_timesteps": 6000, "eval_frequency": 1000, "checkpoint_frequency": 250}
FLAGS = flags(OPTIONS)


def command(root: Path, *chosen: str) -> list[str]:
    return [sys.executable, str(root / "scripts/dqn_train.py"), *chosen]


def start(root: Path, *chosen: str) -> subprocess.Popen:
    return subprocess.Popen(
        command(root, *chosen), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def has_checkpoint(run: Path, process: subprocess.Popen) -> None:
    """Waits for the first one: before it there is nothing to resume."""
    deadline = time.monotonic() + 60
    while not (run / "last.pt").exists():
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture(scope="module")
def whole(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A training that was never interrupted."""
    run = tmp_path_factory.mktemp("whole") / "run"
    process = start(root, *FLAGS, f"--run-dir={run}")
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 0, output
    return run


MORE = [pytest.param(seed, marks=pytest.mark.long) for seed in (2, 3)]


@pytest.mark.parametrize("seed", [0, 1, *MORE])
def test_killed_at_random_moments(root: Path, whole: Path, tmp_path: Path, seed: int) -> None:
    run, moments = tmp_path / "run", random.Random(seed)
    process = start(root, *FLAGS, f"--run-dir={run}")
    has_checkpoint(run, process)
    for _ in range(3):
        before = (run / "last.pt").stat().st_mtime_ns
        # Into the midst of the training: starting up takes longer than all the rest.
        while (run / "last.pt").stat().st_mtime_ns == before and process.poll() is None:
            time.sleep(0.005)
        time.sleep(moments.uniform(0, 1.0))
        process.kill()
        process.communicate()
        process = start(root, f"--resume={run}")
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 0, output
    assert_same_run(whole, run)
    without_doubles(run)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_saves_and_tells(root: Path, whole: Path, tmp_path: Path, number: int) -> None:
    run = tmp_path / "run"
    process = start(root, *FLAGS, f"--run-dir={run}")
    has_checkpoint(run, process)
    process.send_signal(number)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 128 + number, output
    assert "Traceback" not in output and "everything lies in" in output
    process = start(root, f"--resume={run}")
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 0, output
    assert_same_run(whole, run)


def test_two_trainings_in_one_folder(root: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    process = start(root, *FLAGS, f"--run-dir={run}")
    try:
        has_checkpoint(run, process)
        second = subprocess.run(
            command(root, f"--resume={run}"),
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    finally:
        process.kill()
        process.communicate()
    assert second.returncode == 1
    assert second.stderr.strip().endswith(f"a training is running in {run}")
