"""Every block of docs/tutorial_dqn.md, run in order in an empty folder, with shorter trainings.

A block `sh fails` has to fail with one line; one `sh may-fail` has to end or to fail with one line, as
what it does depends on the display. Flags that shorten are put behind those of the page, where they win.
"""

import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
ENGLISH, CHINESE = (ROOT / "docs" / name for name in ("tutorial_dqn.md", "tutorial_dqn.zh.md"))
BLOCK = re.compile(r"^( *)```(\S+)(?: (\S+))?\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
LIMIT = 300.0  # [s] for one command
DQN = ("--total-timesteps 400 --eval-frequency 200 --eval-episodes 1 --confirm-episodes 1 "
       "--learning-starts 50 --checkpoint-frequency 200")  # fmt: skip
SHORTER = {  # command: flags behind its own
    "dqn_train.py": DQN,
    "dqn_train.py --resume": "--total-timesteps 500",
    "eval": "--episodes 2",
    "record": "--max-steps 60",
    "compare": "--episodes 1",
    "train": "--total-timesteps 300 --eval-frequency 150 --eval-episodes 1",
    "sweep": "--trials 1 --total-timesteps 1200",
}
MADE = ["cartpole_training.png", "episode.gif", "episode.mp4", "policy.png", "last.json", "compare.png",
        "compare.json", "both.png", "runs/sweep/trials.json", "robot.gif", "swing_up.gif",
        "gamma.png"]  # fmt: skip


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
    if "--resume" in words:
        key = f"{script} --resume"
    return [*words[1:], *SHORTER.get(key, "").split()]


def run(words: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        words, cwd=folder, capture_output=True, text=True, timeout=LIMIT, check=False
    )


def succeeds(ended: subprocess.CompletedProcess[str]) -> bool:
    if ended.returncode:
        assert ended.returncode == 1 and "Traceback" not in ended.stderr, ended.stderr
    return ended.returncode == 0


def run_block(block: Block, folder: Path) -> None:
    if block.language == "python":
        ended = run([sys.executable, "-c", block.text], folder)
        assert ended.returncode == 0, ended.stderr
        return
    for line in block.text.splitlines():
        ended = run(shortened(line), folder)
        worked = succeeds(ended)
        if block.mark != "may-fail":
            assert worked == (block.mark != "fails"), f"{line}\n{ended.stdout}{ended.stderr}"


@pytest.mark.long
@pytest.mark.extras("imageio_ffmpeg", "optuna", "stable_baselines3", "Box2D")
def test_every_command_of_the_tutorial_runs(tmp_path: Path) -> None:
    for block in blocks(ENGLISH):
        if block.language != "text":
            run_block(block, tmp_path)
    missing = [name for name in MADE if not (tmp_path / name).is_file()]
    assert not missing


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
        assert path.stat().st_size < 200_000, path.name
