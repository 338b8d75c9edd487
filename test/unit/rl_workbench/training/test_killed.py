"""The command line, killed, interrupted and started twice: resumed, it ends where it would have ended."""

import os
import random
import re
import shlex
import signal
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from support.stress.trainings import OPTIONS, forked, new, wait_for_newer_checkpoint
from support.training.training_runs import EXACT, assert_no_doubles, assert_same_run, summary, train

pytestmark = pytest.mark.slow

FREQUENT = {"env_id": "CartPole-v1", "env_kwargs": None}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The same, in this process, and never interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    return cache(lambda name: train(folder / name, name, **{**FREQUENT, **OPTIONS[name]}))


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
    [("dqn", signal.SIGTERM), ("reinforce", signal.SIGHUP),
     pytest.param("ppo", signal.SIGINT, marks=pytest.mark.extras("stable_baselines3"))],
)  # fmt: skip
def test_a_signal_saves_and_tells_how_to_go_on(whole, tmp_path, name: str, number: int) -> None:
    run = tmp_path / "a run"
    with forked(new(name, run), tmp_path) as training:
        wait_for_newer_checkpoint(run, training.is_running)
        os.kill(training.pid, number)
        told = training.ended(128 + number)
    found = re.search(r"^interrupted; --resume (.*) continues from the last", told, re.M)
    assert found and shlex.split(found[1]) == [str(run)]
    assert summary(run)["interrupted"]
    with forked(["--resume", str(run)], tmp_path) as training:
        training.ended()
    assert_same_run(whole(name), run)
