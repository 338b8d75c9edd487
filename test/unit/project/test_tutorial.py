"""Every command of docs/tutorial_dqn.md, with shorter trainings.

They run in order, in an empty folder and in this process: to start thirty of them takes minutes. A block
`sh fails` has to fail with one line; `sh may-fail` depends on the display and may do either. Flags that
shorten a command go behind those of the page, where they win.
"""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from support.pages.code_blocks import blocks

from cartpole import dqn_train, workbench

ROOT = Path(__file__).resolve().parents[3]
DOCS = ROOT / "docs"
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
        "compare.json", "both.png", "runs/sweep/best.yaml", "robot.gif", "swing_up.gif",
        "gamma.png"]  # fmt: skip
MAINS = {"dqn_train.py": dqn_train.main, "workbench.py": workbench.main}


def shortened(line: str) -> list[str]:
    """A script and its arguments, with further flags; ws and its environment are here already."""
    words = shlex.split(line)
    assert words[:3] == ["./ws", "rosrun", "cartpole"], line
    script, *arguments = words[3:]
    key = arguments[0] if script == "workbench.py" else script
    if arguments[:3] == ["train", "--algo", "dqn"]:
        key = "dqn_train.py"
    if "--resume" in arguments:
        key = f"{script} --resume"
    return [script, *arguments, *SHORTER.get(key, "").split()]


def run_line(line: str, mark: str) -> None:
    if line.startswith("./ws python3 examples/"):
        script, *arguments = shlex.split(line)[2:]
        subprocess.run([sys.executable, ROOT / script, *arguments], check=True)
        return
    if line == "./ws extras":  # a test installs nothing; `ws test` has done so
        return
    script, *arguments = shortened(line)
    code = MAINS[script](arguments)
    assert code in (0, 1), line
    if mark != "may-fail":
        assert code == (1 if mark == "fails" else 0), line


@pytest.mark.slow
@pytest.mark.extras("imageio_ffmpeg", "optuna", "stable_baselines3", "Box2D")
def test_every_command_of_the_tutorial_works(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for block in blocks(DOCS / "tutorial_dqn.md"):
        if block.language == "python":
            exec(compile(block.text, "a block of the page", "exec"), {})
        elif block.language != "text":
            for line in block.text.splitlines():
                run_line(line, block.mark)
    assert [name for name in MADE if not Path(name).is_file()] == []


@pytest.mark.parametrize("name", ["tutorial_dqn", "tutorial_robot"])
def test_both_languages_have_the_same_commands(name: str) -> None:
    pages = blocks(DOCS / f"{name}.md"), blocks(DOCS / f"{name}.zh.md")
    mine, other = (
        [(*each[:2], each.language == "text" or re.sub(r" *#.*", "", each.text)) for each in page]
        for page in pages
    )
    assert mine == other
