"""The short examples run as their first lines say, and print what they promise."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from robot_envs import EnvSnapshot
from ros_utils.simulation import reserved_port

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
LIMIT = 300.0  # [s] for a process


def printed(name: str, *words: object) -> str:
    uri = f"http://127.0.0.1:{reserved_port()}"
    ended = subprocess.run(
        [sys.executable, EXAMPLES / f"{name}.py", *map(str, words)],
        env={**os.environ, "ROS_MASTER_URI": uri}, timeout=LIMIT, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def test_a_first_episode_ends_when_the_pole_has_fallen() -> None:
    cart, pole, total = map(float, re.findall(r"[-+\d.]+\d", printed("first_episode")))
    assert abs(cart) > 0.4 or abs(pole) > 0.209
    assert 5 < total < 500


def test_the_arm_stretches() -> None:
    *joints, ahead = map(float, re.findall(r"[-+]?\d+\.\d+", printed("own_robot")))
    assert max(map(abs, joints)) < 0.15
    assert ahead == pytest.approx(0.55, abs=0.01)  # both links in a line


def test_eight_poles_are_held_for_500_steps() -> None:
    assert printed("many_worlds").split(":")[1].split() == ["500"] * 8


def test_each_episode_has_another_robot() -> None:
    lines = printed("varied_robot").splitlines()
    assert len(lines) == len(set(lines)) == 3
    masses = [float(each) for line in lines for each in re.findall(r": ([\d.]+)[,}]", line)]
    assert len(masses) == 6 and all(0.8 <= each <= 1.2 for each in masses)


def test_sensors_measure_a_room(tmp_path: Path) -> None:
    text = printed("sensor_readings", tmp_path / "depth.png")
    assert text.startswith("360 ranges")
    with Image.open(tmp_path / "depth.png") as picture:
        assert np.unique(np.asarray(picture)).size > 10


def test_a_gif_moves(tmp_path: Path) -> None:
    printed("record_gif", tmp_path / "hopper.gif")
    with Image.open(tmp_path / "hopper.gif") as picture:
        assert picture.n_frames > 5
        first = np.asarray(picture.convert("RGB"))
        picture.seek(picture.n_frames - 1)
        assert (first != np.asarray(picture.convert("RGB"))).mean() > 0.01


def test_a_file_is_continued_to_the_bit(tmp_path: Path) -> None:
    assert printed("snapshot_file", tmp_path / "moment.snapshot").endswith("equal: True\n")
    assert EnvSnapshot.load(tmp_path / "moment.snapshot").state["steps"] == 30


@pytest.mark.slow
def test_steps_over_ros_repeat() -> None:
    first, again = (printed("steps_over_ros").splitlines()[-1] for _ in range(2))
    assert first == again
    assert abs(float(re.findall(r"-?\d\.\d{5,}", first)[0])) < 0.1
