"""The page beside a training: it comes and goes with it, and the training notices nothing."""

import json
import os
import signal
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.training.training_runs import assert_same_run

from rl_workbench.training import train as cli
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.page import Page
from rl_workbench.training.train import choose

BOUND = 60.0  # [s]
SHORT = ["--algo=dqn", "--total-timesteps=300", "--learning-starts=50", "--eval-episodes=1"]
# Writes the arguments once it is up, and a file once its input has ended.
PAGE = """import sys
from pathlib import Path
folder = Path(sys.argv[2])
with open(folder / "up", "w") as up:
    up.write(" ".join(sys.argv[1:]))
sys.stdin.read()
(folder / "ended").touch()
"""


def begun(folder: Path, text: str) -> Page:
    """A page whose program has written to the pipe FOLDER/up, and so is running."""
    os.mkfifo(folder / "up")
    shown = Page((sys.executable, "-c", text))
    shown.on_training_start(SimpleNamespace(folder=folder))
    command = f"view {folder} --beside-training --checkpoint last best random"
    assert (folder / "up").read_text() == command
    return shown


def test_it_runs_beside_the_training_and_ends_with_it(tmp_path) -> None:
    shown = begun(tmp_path, PAGE)
    assert not (tmp_path / "ended").exists()
    shown.on_training_end(None)
    shown._process.wait(BOUND)
    assert (tmp_path / "ended").exists()


def test_without_a_page_the_training_goes_on(tmp_path, capsys) -> None:
    shown = Page(("/no/such/program",))
    shown.on_training_start(SimpleNamespace(folder=tmp_path))
    shown.on_training_end(None)
    words = "no page; the training continues without one: No such file or directory\n"
    assert capsys.readouterr().out == words


def test_one_that_is_killed_or_hangs_isnt_waited_for(tmp_path) -> None:
    shown = begun(tmp_path, PAGE)
    shown._process.kill()
    shown.on_training_end(None)
    (tmp_path / "up").unlink()
    shown = begun(tmp_path, PAGE.replace("sys.stdin.read()", "import signal; signal.pause()"))
    shown.on_training_end(None)
    assert shown._process.poll() is None, "it still hangs, and the training is over"
    shown._process.kill()
    assert shown._process.wait(BOUND) == -signal.SIGKILL


@pytest.mark.parametrize("name", ["dqn", "reinforce", "reinforce-document"])
def test_it_is_no_setting(name: str) -> None:
    kind = ALGORITHMS[name]
    flags = ["--total-timesteps=10"]
    plain, shown = choose(kind, flags), choose(kind, [*flags, "--gui"])
    assert shown.session.gui and not plain.session.gui
    assert shown.record() == plain.record()
    assert choose(kind, flags, {"gui": True}).session.gui
    assert not choose(kind, [*flags, "--no-gui"], {"gui": "true"}).session.gui


@pytest.mark.slow
def test_the_bits_are_the_same_and_a_resumed_training_may_have_it(tmp_path) -> None:
    plain, shown = tmp_path / "plain", tmp_path / "shown"
    assert cli.main([*SHORT, f"--run-dir={plain}"]) == 0
    assert cli.main([*SHORT, f"--run-dir={shown}", "--gui"]) == 0
    assert_same_run(plain, shown)
    assert "gui" not in json.dumps(json.loads((shown / "config.json").read_text())["run"])
    longer = ["--total-timesteps=400"]
    assert cli.main(["--resume", str(shown), *longer, "--gui"]) == 0
    assert cli.main(["--resume", str(plain), *longer]) == 0
    assert_same_run(plain, shown)
