"""Ctrl-C: at once while starting, at the next step while training."""

import os
import signal

import pytest

from rl_workbench.training.run.interrupt import Interrupt


@pytest.fixture
def interrupt() -> Interrupt:
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield Interrupt().install()
    for number, handler in before.items():
        signal.signal(number, handler)


def test_while_starting_it_ends_any_wait(interrupt: Interrupt) -> None:
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)
    assert interrupt.exit_code == 130


def test_while_training_it_is_only_noted_however_often(interrupt: Interrupt) -> None:
    interrupt.defer()
    assert not interrupt.requested()
    assert interrupt.exit_code == 0
    for _ in range(3):
        os.kill(os.getpid(), signal.SIGINT)
    assert interrupt.requested()
    assert interrupt.exit_code == 130


def test_after_training_it_ends_any_wait_again(interrupt: Interrupt) -> None:
    interrupt.defer()
    interrupt.at_once()
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


def test_one_that_was_deferred_is_not_forgotten(interrupt: Interrupt) -> None:
    interrupt.defer()
    os.kill(os.getpid(), signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        interrupt.at_once()


def test_sigterm_has_its_own_code(interrupt: Interrupt) -> None:
    interrupt.defer()
    os.kill(os.getpid(), signal.SIGTERM)
    assert interrupt.exit_code == 143
