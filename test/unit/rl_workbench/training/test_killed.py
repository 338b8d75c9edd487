"""The command line, killed, interrupted and started twice: resumed, it ends where it would have ended."""

import random
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest
from support.stress.trainings import OPTIONS, forked, new, wait_for_newer_checkpoint
from support.training.training_runs import (
    EXACT,
    assert_no_doubles,
    assert_same_run,
    summary,
    train,
)

pytestmark = pytest.mark.slow

FREQUENT = {"env_id": "CartPole-v1", "env_kwargs": None}
COMMAND = [sys.executable, "-m", "rl_workbench", "train"]
Start = Callable[..., subprocess.Popen]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts the command with arguments; or by way of another one, such as nohup."""
    started: list[subprocess.Popen] = []

    def begin(*arguments: str, by: str = "") -> subprocess.Popen:
        command = [*shlex.split(by), *COMMAND, *arguments]
        started.append(
            subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=tmp_path
            )
        )
        return started[-1]

    yield begin
    for each in started:
        if each.poll() is None:
            each.kill()
            each.communicate()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The same, in this process, and never interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    return cache(lambda name: train(folder / name, name, **{**FREQUENT, **OPTIONS[name]}))


def ended(process: subprocess.Popen, code: int = 0) -> str:
    output, _ = process.communicate(timeout=120)
    assert process.returncode == code, output
    assert "Traceback" not in output
    return output


def newer_checkpoint(run: Path, process: subprocess.Popen) -> None:
    """Waits for one, or for the end: starting up takes longer than all the rest."""
    wait_for_newer_checkpoint(run, lambda: process.poll() is None)


@pytest.mark.parametrize("name", EXACT)
def test_killed_at_random_moments(whole, tmp_path: Path, name: str) -> None:
    """Hundreds of times: test/stress/test_kills.py."""
    run, moments, killed = tmp_path / "run", random.Random(0), 0
    arguments = new(name, run)
    for _ in range(3):
        with forked(arguments, tmp_path) as training:
            wait_for_newer_checkpoint(run, training.is_running)
            time.sleep(moments.uniform(0, 0.4))  # anywhere: in a step, an evaluation, a checkpoint
            killed += training.kill()
        arguments = ["--resume", str(run)]
    with forked(arguments, tmp_path) as training:
        training.ended()
    assert killed
    assert_same_run(whole(name), run)
    assert_no_doubles(run)


@pytest.mark.parametrize(
    ("name", "number"),
    [("dqn", signal.SIGINT), ("dqn", signal.SIGTERM), ("reinforce", signal.SIGHUP),
     ("reinforce-document", signal.SIGINT),
     pytest.param("ppo", signal.SIGINT, marks=pytest.mark.extras("stable_baselines3"))],
)  # fmt: skip
def test_a_signal_saves_and_tells_how_to_go_on(
    start: Start, whole, tmp_path: Path, name: str, number: int
) -> None:
    run = tmp_path / "a run"
    process = start(*new(name, run))
    newer_checkpoint(run, process)
    process.send_signal(number)
    told = ended(process, 128 + number)
    found = re.search(
        r"^interrupted; --resume (.*) continues from the last checkpoint$", told, re.M
    )
    assert found and shlex.split(found[1]) == [str(run)]
    assert summary(run)["interrupted"]
    ended(start("--resume", str(run)))
    assert_same_run(whole(name), run)


def test_two_trainings_in_one_folder(start: Start, tmp_path: Path) -> None:
    run = tmp_path / "run"
    process = start(*new("dqn", run), "--total-timesteps=1000000")
    newer_checkpoint(run, process)
    assert f"a training is running in {run}" in ended(start("--resume", str(run)), 1)
    assert "is running in" in ended(start(*new("dqn", run)), 1)
    assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    ended(process, 143)
