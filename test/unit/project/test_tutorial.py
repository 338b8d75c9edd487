"""Every command of docs/tutorial_dqn.md and of README's workbench, with shorter trainings.

They run in order in an empty folder. A block `sh fails` has to fail with one line; one `sh may-fail` has
to end or to fail with one line, as what it does depends on the display. Flags that shorten are put behind
those of the page, where they win. In the normal run all of it happens in this process, since starting
thirty of them takes minutes; the long test starts them.
"""

import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from cartpole import dqn_train, workbench

pytestmark = pytest.mark.usefixtures("signals")

ROOT = Path(__file__).resolve().parents[3]
ENGLISH, CHINESE = (ROOT / "docs" / name for name in ("tutorial_dqn.md", "tutorial_dqn.zh.md"))
README = ROOT / "README.md"
BLOCK = re.compile(r"^( *)```(\S+)(?: (\S+))?\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
LIMIT = 300.0  # [s] for one command
INTERRUPTED = 130  # exit code
DQN = ("--total-timesteps 400 --eval-frequency 200 --eval-episodes 1 --confirm-episodes 1 "
       "--learning-starts 50 --checkpoint-frequency 200")  # fmt: skip
SHORTER = {  # command: flags behind its own
    "dqn_train.py": DQN,
    "dqn_train.py --resume": "--total-timesteps 500",
    "workbench.py --resume": "--total-timesteps 500",
    "eval": "--episodes 2",
    "record": "--max-steps 60",
    "compare": "--episodes 1",
    "train": "--total-timesteps 300 --eval-frequency 300 --eval-episodes 1",
    "sweep": "--trials 1 --total-timesteps 1200",
}
MADE = ["cartpole_training.png", "episode.gif", "episode.mp4", "policy.png", "last.json", "compare.png",
        "compare.json", "both.png", "runs/sweep/trials.json", "robot.gif", "swing_up.gif",
        "gamma.png"]  # fmt: skip
MAINS = {"dqn_train.py": dqn_train.main, "workbench.py": workbench.main}


class Block(NamedTuple):
    language: str
    mark: str
    text: str


def blocks(path: Path) -> list[Block]:
    return [
        Block(match[2], match[3] or "", re.sub(f"^{match[1]}", "", match[4], flags=re.MULTILINE))
        for match in BLOCK.finditer(path.read_text(encoding="utf-8"))
    ]


def shortened(line: str) -> list[str]:
    """The words of a command with further flags; ws and its environment are here already."""
    words = shlex.split(line)
    assert words[0] == "./ws", line
    if words[1:] == ["extras"]:
        return [str(ROOT / "ws"), "extras"]
    assert words[1:3] == ["rosrun", "cartpole"], line
    script = words[3]
    key = words[4] if script == "workbench.py" else script
    if words[4:7] == ["train", "--algo", "dqn"]:
        key = "dqn_train.py"
    if "--resume" in words:
        key = f"{script} --resume"
    return [*words[1:], *SHORTER.get(key, "").split()]


def as_process(words: list[str]) -> tuple[int, str]:
    """Exit code and errors of a command."""
    ended = subprocess.run(words, capture_output=True, text=True, timeout=LIMIT, check=False)
    return ended.returncode, ended.stderr


def here(words: list[str]) -> tuple[int, str]:
    """The same without a process where that is possible; errors are on standard error."""
    if words[0] != "rosrun":
        return as_process(words)
    return MAINS[words[2]](words[3:]), ""


def run_block(block: Block, run: Callable[[list[str]], tuple[int, str]]) -> None:
    if block.language == "python":
        if run is here:
            exec(compile(block.text, "a block of the page", "exec"), {})
        else:
            assert run([sys.executable, "-c", block.text])[0] == 0
        return
    for line in block.text.splitlines():
        run_line(line, block.mark, run)


def run_line(line: str, mark: str, run: Callable[[list[str]], tuple[int, str]]) -> None:
    code, errors = run(shortened(line))
    assert code in (0, 1) and "Traceback" not in errors, f"{line}\n{errors}"
    if mark != "may-fail":
        assert code == (1 if mark == "fails" else 0), f"{line}\n{errors}"


def show_page(line: str) -> None:
    """Runs a command that serves a page until somebody ends it."""
    words = [sys.executable, "-m", "cartpole.workbench", *shlex.split(line)[4:]]
    environment = {**os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": ""}  # opens no browser
    with subprocess.Popen(
        words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as shown:
        assert shown.stdout is not None
        lines = iter(shown.stdout.readline, "")
        told = next((each for each in lines if "is the page" in each), "")
        shown.send_signal(signal.SIGINT)
        assert told and shown.wait(LIMIT) == INTERRUPTED, told


def check_tutorial(run: Callable[[list[str]], tuple[int, str]]) -> None:
    for block in blocks(ENGLISH):
        if block.language != "text":
            run_block(block, run)
    missing = [name for name in MADE if not Path(name).is_file()]
    assert not missing


@pytest.mark.slow
@pytest.mark.extras("optuna", "stable_baselines3", "Box2D")
def test_every_command_of_the_tutorial_works(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    check_tutorial(here)


@pytest.mark.long
@pytest.mark.extras("optuna", "stable_baselines3", "Box2D")
def test_every_command_of_the_tutorial_works_as_a_process(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    check_tutorial(as_process)


def readme_commands() -> list[str]:
    """Those of README's section on the workbench, without their remarks; not the long benchmark."""
    section = (
        README.read_text(encoding="utf-8").split("## DQN, and a workbench")[1].split("\n## ")[0]
    )
    lines = [line.strip() for line in section.splitlines() if line.startswith("    ./ws rosrun")]
    return [shlex.join(shlex.split(line, comments=True)) for line in lines]


@pytest.mark.extras("optuna", "stable_baselines3")
def test_every_command_of_the_readme_works(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for line in readme_commands():
        words = line.split()
        if words[-1] == "--help" or words[4:5] == ["benchmark"]:
            continue
        if "--gui" in words:
            show_page(line)
        else:
            run_line(line, "may-fail" if "enjoy" in words else "", here)
    assert Path("episode.gif").is_file() and Path("compare.png").is_file()


def test_the_readme_has_a_command_for_each_thing_to_do() -> None:
    said = " ".join(readme_commands())
    for word in ("train", "enjoy", "record", "--resume", "compare", "plot", "eval", "sweep"):
        assert f" {word} " in said, word


def test_both_languages_have_the_same_commands() -> None:
    mine, other = blocks(ENGLISH), blocks(CHINESE)
    assert len(mine) > 15
    code = [re.sub(r" *#.*", "", block.text) for block in mine if block.language != "text"]
    assert code == [re.sub(r" *#.*", "", each.text) for each in other if each.language != "text"]
    assert [block[:2] for block in mine] == [block[:2] for block in other]


@pytest.mark.parametrize("path", [ENGLISH, CHINESE], ids=lambda path: path.name)
def test_pictures_and_links_are_there(path: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", path.read_text(encoding="utf-8")):
        assert (path.parent / target).exists(), target


def test_pictures_are_small() -> None:
    for path in (ROOT / "docs/images").glob("workbench_*"):
        most = 500_000 if path.suffix == ".gif" else 200_000
        assert path.stat().st_size < most, path.name
