"""Trainings in processes forked from one that has imported everything, which takes longest."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import random
import resource
import shlex
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from multiprocessing import connection
from pathlib import Path
from typing import Any

from support.training.training_runs import SMALL, flags

BOUND = 600.0  # [s] for anything that a training does, on a busy machine
# Trainings of about two seconds, with checkpoints and evaluations as often as a kill is to find one.
OPTIONS: dict[str, dict[str, Any]] = {
    "dqn": {"total_timesteps": 3500, "eval_frequency": 1000, "checkpoint_frequency": 250},
    "reinforce": {"num_envs": 2, "episodes": 90, "eval_frequency": 500, "checkpoint_frequency": 25},
    "reinforce-document": {"episodes": 90, "eval_frequency": 500, "checkpoint_frequency": 25},
    "ppo": {"total_timesteps": 5000, "eval_frequency": 1000, "checkpoint_frequency": 250},
    "sac": {"env_id": "Pendulum-v1", "env_kwargs": "max_episode_steps=20", "total_timesteps": 800,
            "eval_frequency": 200, "checkpoint_frequency": 50},
}  # fmt: skip
# Every start of a process reads the exit codes of all that have ended, and each can be read once.
_ONE_AT_A_TIME = threading.Lock()
_ANYWHERE = {"env_id": "CartPole-v1", "env_kwargs": None}
IMPORTED = [
    *(f"rl_workbench.training.{name}" for name in ("train", "training", "dqn", "pg")),
    *("torch._dynamo", "torch.utils.tensorboard", "matplotlib.pyplot"),
]


def new(name: str, run: Path, **changed: object) -> list[str]:
    """The arguments of such a training; no file's options count."""
    options = {**SMALL[name], **_ANYWHERE, **OPTIONS[name], **changed, "run_dir": run}
    chosen = {key: value for key, value in options.items() if value is not None}
    return ["--algo", name, "--config", "/dev/null", *flags(chosen)]


class Forked:
    """A training command under way, whose output goes to a file of the folder that it runs in.

    `limits` are by their numbers in `resource`; RLIMIT_AS is what it may take besides.
    """

    def __init__(self, arguments: list[str], folder: Path, limits: Mapping[int, int] | None = None) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.log = folder / "output.txt"
        self._arguments = arguments
        context = _forking()
        self._process = context.Process(
            target=_command, args=(arguments, folder, self.log, dict(limits or {})), daemon=True
        )
        with _ONE_AT_A_TIME:
            self._process.start()

    @property
    def pid(self) -> int:
        """The process's id."""
        assert self._process.pid is not None
        return self._process.pid

    @property
    def output(self) -> str:
        """What it has said so far."""
        return self.log.read_text(errors="replace") if self.log.exists() else ""

    def is_running(self) -> bool:
        return self._code(0) is None

    def kill(self) -> bool:
        """Ends it by SIGKILL; returns whether it was under way still."""
        self._process.kill()
        return self._code(BOUND) == -9

    def code(self) -> int:
        """Waits for its end; returns the exit code."""
        code = self._code(BOUND)
        told = f"{shlex.join(self._arguments)}\n{self.output[-3000:]}"
        assert code is not None, f"no end after {BOUND:.0f} s: {told}"
        return code

    def _code(self, bound: float) -> int | None:
        """The exit code, or None if it still runs after `bound` [s]."""
        connection.wait([self._process.sentinel], bound)
        with _ONE_AT_A_TIME:
            return self._process.exitcode

    def ended(self, *codes: int) -> str:
        """Waits for an end with one of these codes and without a traceback; returns what it said."""
        code, told = self.code(), self.output
        assert code in (codes or (0,)), f"exit code {code}:\n{told[-3000:]}"
        assert "Traceback" not in told, told[-3000:]
        return told


def _forking() -> multiprocessing.context.ForkServerContext:
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(IMPORTED)
    return context


def _command(arguments: list[str], folder: Path, log: Path, limits: dict[int, int]) -> None:
    from rl_workbench.training.train import main

    os.chdir(folder)
    with log.open("ab") as output:
        for stream in (1, 2):
            os.dup2(output.fileno(), stream)
    # As after a start with its output in a file.
    sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w", buffering=1)
    for number, most in limits.items():
        taken = _size() if number == resource.RLIMIT_AS else 0
        resource.setrlimit(number, (taken + most, taken + most))
    sys.exit(main(arguments))


def _size() -> int:
    """This process's memory, with all that was imported [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


@contextlib.contextmanager
def forked(arguments: list[str], folder: Path, limits: Mapping[int, int] | None = None) -> Iterator[Forked]:
    """One for the length of a block; nothing of it outlives that."""
    training = Forked(arguments, folder, limits)
    try:
        yield training
    finally:
        training.kill()


def wait_for_newer_checkpoint(run: Path, is_running: Callable[[], bool]) -> None:
    """Or for the training's end."""

    def written() -> int:
        with contextlib.suppress(FileNotFoundError):
            return (run / "last.pt").stat().st_mtime_ns
        return 0

    before, deadline = written(), time.monotonic() + BOUND
    while written() == before and is_running():
        assert time.monotonic() < deadline, f"no checkpoint after {BOUND:.0f} s"
        time.sleep(0.002)


def random_moment(dice: random.Random, run: Path, training: Forked) -> None:
    """Waits for one: in the start, or after a checkpoint in a step, an evaluation, another checkpoint."""
    if dice.random() < 0.2:
        time.sleep(dice.uniform(0.0, 1.0))
    else:
        wait_for_newer_checkpoint(run, training.is_running)
        time.sleep(dice.uniform(0.0, 0.3))
