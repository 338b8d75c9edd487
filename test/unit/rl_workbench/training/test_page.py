"""The page beside a training: it comes and goes with it, and the training notices nothing."""

import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from support.training.training_runs import assert_same_run

from rl_workbench.training import page
from rl_workbench.training import train as cli
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.command_line import choose
from rl_workbench.training.page import page_beside

pytestmark = pytest.mark.usefixtures("signals")

BOUND = 180.0  # [s]
SHORT = ["--algo=dqn", "--total-timesteps=300", "--learning-starts=50", "--eval-episodes=1"]
TELLS = "import os, sys; print('it is here', flush=True); os.close(1); "

# Gives up where nothing trains: it would be waited for.
TELLS_ONCE_IT_TRAINS = """import os, sys, time
for _ in range(600):
    if os.path.exists(sys.argv[2] + "/trains"):
        print("it is here", flush=True)
        break
    time.sleep(0.1)
sys.stdin.read()
"""


def program(text: str) -> tuple[str, ...]:
    return (sys.executable, "-c", text)


def children() -> set[int]:
    pid = os.getpid()
    return {int(each) for each in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()}


class Told(list[str]):
    """What was told; the first line can be waited for."""

    def __init__(self) -> None:
        self.first = threading.Event()

    def __call__(self, line: str) -> None:
        self.append(line)
        self.first.set()


def test_its_address_is_told_while_it_trains_and_it_ends_after(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(page, "END", BOUND)
    told = Told()
    text = TELLS + "sys.stdin.read(); open(sys.argv[2] + '/ended', 'w').close()"
    with page_beside(tmp_path, program(text), told):
        assert told.first.wait(BOUND)
        assert told == ["it is here"]
        assert not (tmp_path / "ended").exists()
    assert (tmp_path / "ended").exists()


def test_the_training_doesnt_wait_for_one_that_is_slow_to_start(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(page, "END", BOUND)
    before, told = children(), Told()
    with page_beside(tmp_path, program(TELLS_ONCE_IT_TRAINS), told):
        assert children() > before and not told
        (tmp_path / "trains").touch()
        assert told.first.wait(BOUND)
    assert children() <= before


def test_it_is_told_the_run_and_to_end_with_the_training(tmp_path) -> None:
    told = Told()
    with page_beside(tmp_path, program("import sys; print(sys.argv[1:])"), told):
        assert told.first.wait(BOUND)
    assert told == [
        str(["view", str(tmp_path), "--beside-training", "--checkpoint", "last", "best", "random"])
    ]


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("/no/such/program",), "no page; the training goes on without one: No such file"),
        (program("raise SystemExit(1)"), "the page didn't open; the training goes on without it"),
    ],
)
def test_without_a_page_the_training_goes_on(tmp_path, command, words) -> None:
    told = Told()
    with page_beside(tmp_path, command, told):
        assert told.first.wait(BOUND)
    assert told[0].startswith(words)


def test_one_that_is_killed_or_hangs_isnt_waited_for(tmp_path, monkeypatch) -> None:
    before = children()
    told = Told()
    with page_beside(tmp_path, program(TELLS + "sys.stdin.read()"), told):
        assert told.first.wait(BOUND)
        (pid,) = children() - before
        os.kill(pid, signal.SIGKILL)
    assert children() <= before
    monkeypatch.setattr(page, "END", 0.2)
    told = Told()
    with page_beside(tmp_path, program(TELLS + "import time\nwhile True: time.sleep(1)"), told):
        assert told.first.wait(BOUND)
    assert children() <= before


@pytest.mark.parametrize("name", ["dqn", "reinforce", "reinforce-document"])
def test_it_is_no_setting(name: str) -> None:
    kind = ALGORITHMS[name]
    flags = ["--total-timesteps=10"]
    plain, shown = choose(kind, flags), choose(kind, [*flags, "--gui"])
    assert shown.session.gui and not plain.session.gui
    assert shown.record() == plain.record()
    assert choose(kind, flags, {"gui": True}).session.gui
    assert not choose(kind, [*flags, "--no-gui"], {"gui": "true"}).session.gui


@contextmanager
def page_that_is_up(
    folder: Path, program: tuple[str, ...], say: Callable[[str], None]
) -> Iterator[None]:
    """The training begins once the page is there: it would be over first."""
    is_up = threading.Event()

    def tell(line: str) -> None:
        say(line)
        is_up.set()

    with page_beside(folder, program, tell):
        assert is_up.wait(BOUND)
        yield


@pytest.mark.slow
def test_the_bits_are_the_same_and_a_resumed_training_may_have_it(
    tmp_path, capsys, monkeypatch
) -> None:
    monkeypatch.setattr("rl_workbench.training.page.page_beside", page_that_is_up)
    plain, shown = tmp_path / "plain", tmp_path / "shown"
    assert cli.main([*SHORT, f"--run-dir={plain}"]) == 0
    assert "is the page" not in capsys.readouterr().out
    assert cli.main([*SHORT, f"--run-dir={shown}", "--gui"]) == 0
    assert "the run is the page http://127.0.0.1:" in capsys.readouterr().out
    assert_same_run(plain, shown)
    assert "gui" not in json.dumps(json.loads((shown / "config.json").read_text())["run"])
    longer = ["--total-timesteps=400"]
    assert cli.main(["--resume", str(shown), *longer, "--gui"]) == 0
    assert "the run is the page" in capsys.readouterr().out
    assert cli.main(["--resume", str(plain), *longer]) == 0
    assert_same_run(plain, shown)
