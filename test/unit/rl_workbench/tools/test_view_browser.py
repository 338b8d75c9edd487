"""A run's page in a real browser: its robot, its player; afterwards, and while it trains."""

import io
import os
import re
import signal
import sys
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.pages.browser import BOUND, Browser, Output, find_browser, wait_for
from support.training.workbench_runs import policy_gradient

import cartpole  # noqa: F401 - registers its environments

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not find_browser(), reason="no Chromium: apt-get install chromium"),
]
WORKBENCH = (sys.executable, "-m", "cartpole.workbench")
SRC = Path(__file__).resolve().parents[4] / "src"
SIZE = (900, 650)  # [pixels]: it is drawn without a graphics card
BLUE, ORANGE = (20, 90, 190), (230, 140, 40)  # cart and pole of our robot
BLACK, BROWN = (0, 0, 0), (202, 152, 101)  # and of the pictures of CartPole-v1
HOSTILE = "<img src=x onerror='hurt=1'>né🤖"


@pytest.fixture
def start():
    commands = []

    def started(*words: str) -> Output:
        environment = {**os.environ, "PYTHONPATH": str(SRC)}
        commands.append(Output(*WORKBENCH, *words, env=environment))
        return commands[-1]

    yield started
    for each in commands:
        each.close(signal.SIGKILL)


def is_seen(page: Browser, *colours: tuple[int, int, int]) -> bool:
    """Whether something of about each of the colours is left of the panel, below notices."""
    pixels = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"), int)[160:, :550]
    return all((abs(pixels - colour).max(axis=-1) < 45).sum() > 50 for colour in colours)


def pause(page: Browser) -> None:
    """What moves is drawn without a graphics card here, and keeps the page from all else."""
    wait_for(lambda: step_of(page) >= 0, "episode")
    page.click("Pause")
    page.wait_for_text("Play\n")


def step_of(page: Browser) -> int:
    found = re.search(r"step (\d+) of", page.text)
    return int(found[1]) if found else -1


def is_served(url: str) -> bool:
    try:
        urllib.request.urlopen(url, timeout=BOUND).close()
    except (urllib.error.URLError, ConnectionError):
        return False
    return True


def test_a_run_is_seen_and_played(start, tmp_path) -> None:
    run = policy_gradient(tmp_path / HOSTILE, env_id="cartpole/Balance-v0", episodes=30, seed=1)
    viewing = start("view", str(run), "--port", "0", "--checkpoint", "best", "random")
    with Browser(viewing.url, size=SIZE) as page:
        page.wait_for_text("best, of step")
        pause(page)
        wait_for(lambda: is_seen(page, BLUE, ORANGE), "robot in 3-D")
        page.push_slider("Step", "Home", 1)
        page.wait_for_text("step 0 of")
        page.push_slider("Step", "ArrowRight", 3)
        page.wait_for_text("step 3 of")
        page.choose("1 ×", "0.1 ×")
        assert "step 3 of" in page.text, "it is paused"
        page.click("Play")
        wait_for(lambda: step_of(page) > 3, "step")
        page.choose("best", "random")
        page.wait_for_text("random, seed 0")
        page.type("input.mantine-NumberInput-input", 20 * "9")
        page.reload()
        page.wait_for_text("random, seed ")
        assert HOSTILE in page.text, "the run's name"
        assert page.run("window.hurt") is None
    assert viewing.close(signal.SIGINT) == 130
    assert len(viewing.lines) == 2


def test_a_training_is_seen_while_it_learns(start, tmp_path) -> None:
    training = start(
        "train", "--algo=reinforce", "--env-id=CartPole-v1", f"--run-dir={tmp_path / 'run'}",
        "--total-timesteps=100000000", "--stop-at-length=0", "--checkpoint-frequency=2000", "--gui",
    )  # fmt: skip
    url = training.url
    with Browser(url, size=SIZE) as page:
        pause(page)
        wait_for(lambda: is_seen(page, BLACK, BROWN), "picture of the robot")
        learned = tmp_path / "run" / "checkpoints"
        wait_for(lambda: len(list(learned.glob("*.pt"))) > 1, "checkpoint that has learned")
        page.click("Play the newest now")
        wait_for(lambda: re.search(r"last, of step [1-9]", page.text), "its episode")
    pid = training.process.pid
    os.kill(int(Path(f"/proc/{pid}/task/{pid}/children").read_text()), signal.SIGKILL)
    table = tmp_path / "run" / "scalars.csv"
    size = table.stat().st_size
    wait_for(lambda: table.stat().st_size > size + 5000, "training that goes on")
    assert not is_served(url)
    assert training.close(signal.SIGINT) == 130
    assert any("interrupted" in line for line in training.lines)


def test_the_page_ends_with_its_training_whatever_ends_it(start, tmp_path) -> None:
    long = ("--total-timesteps=100000000", "--gui")
    training = start("train", "--algo=dqn", f"--run-dir={tmp_path / 'run'}", *long)
    url = training.url
    assert is_served(url)
    training.process.kill()
    wait_for(lambda: not is_served(url), "end of the page")
