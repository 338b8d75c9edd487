"""Ctrl-C: at once while starting, whatever modules do with exceptions; at the next step while training."""

import signal
import subprocess
import sys

import pytest

from rl_workbench.starting import Interrupt

PROGRAM = """
import signal, sys
from rl_workbench.starting import ended_by_ctrl_c

if "ignored" in sys.argv:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
with ended_by_ctrl_c():
    try:
        if "inside" in sys.argv:
            signal.raise_signal(signal.SIGINT)
    except BaseException:
        print("swallowed")
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    print("as ever")
"""


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [(["inside"], 130, "-c: interrupted\n"), ([], 0, "as ever\n"), (["inside", "ignored"], 0, "")],
    ids=["inside", "afterwards", "ignored"],
)
def test_ctrl_c(arguments: list[str], code: int, told: str) -> None:
    command = [sys.executable, "-c", PROGRAM, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout + done.stderr) == (code, told)


def test_the_commands_start_so(root) -> None:
    """All that may take long comes after it."""
    for script in (root / "scripts").iterdir():
        lines = [line for line in script.read_text().splitlines() if "import " in line]
        ours = [line for line in lines if line[7:] not in ("argparse", "os", "sys")]
        assert ours[0].startswith("    from rl_workbench.starting import ended_by_ctrl_c"), script


@pytest.fixture
def interrupt() -> Interrupt:
    return Interrupt().install()


def test_while_starting_it_ends_any_wait(interrupt: Interrupt) -> None:
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    assert interrupt.exit_code == 130


def test_while_training_it_is_only_noted_however_often(interrupt: Interrupt) -> None:
    interrupt.defer()
    assert not interrupt.requested()
    assert interrupt.exit_code == 0
    for _ in range(3):
        signal.raise_signal(signal.SIGINT)
    assert interrupt.requested()
    assert interrupt.exit_code == 130


def test_while_modules_are_read_it_waits(interrupt: Interrupt) -> None:
    read = []
    with pytest.raises(KeyboardInterrupt), interrupt.reading():
        signal.raise_signal(signal.SIGINT)
        read.append("all")
    assert read == ["all"]
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_one_that_was_deferred_is_not_forgotten(interrupt: Interrupt) -> None:
    interrupt.defer()
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        interrupt.at_once()


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGXCPU, 152)]
)
def test_other_signals_have_codes_of_their_own(interrupt, number: int, code: int) -> None:
    interrupt.defer()
    signal.raise_signal(number)
    assert interrupt.requested() and interrupt.exit_code == code
    # Python gives all handlers but this one up when it ends, while the signal goes on to come.
    assert (signal.getsignal(number) == signal.SIG_IGN) == (number == signal.SIGXCPU)


def test_a_closed_terminal_that_is_to_be_ignored_is_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    interrupt = Interrupt().install()
    signal.raise_signal(signal.SIGHUP)
    assert not interrupt.requested()
