"""The short examples run as their first lines say, and print what they promise."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from robot_envs import EnvSnapshot


def test_a_first_episode_ends_when_the_pole_has_fallen(printed) -> None:
    cart, pole, total = map(float, re.findall(r"[-+\d.]+\d", printed("first_episode.py")))
    assert abs(cart) > 0.4 or abs(pole) > 0.209
    assert 5 < total < 500


def test_the_arm_stretches(printed) -> None:
    *joints, ahead = map(float, re.findall(r"[-+]?\d+\.\d+", printed("own_robot.py")))
    assert max(map(abs, joints)) < 0.15
    assert ahead == pytest.approx(0.55, abs=0.01)  # both links in a line


def test_eight_poles_are_held_for_500_steps(printed) -> None:
    assert printed("many_worlds.py").split(":")[1].split() == ["500"] * 8


def test_each_episode_has_another_robot(printed) -> None:
    lines = printed("varied_robot.py").splitlines()
    assert len(lines) == len(set(lines)) == 3
    masses = [float(each) for line in lines for each in re.findall(r": ([\d.]+)[,}]", line)]
    assert len(masses) == 6 and all(0.8 <= each <= 1.2 for each in masses)


def test_sensors_measure_a_room(printed, tmp_path: Path) -> None:
    text = printed("sensor_readings.py", tmp_path / "depth.png")
    assert text.startswith("360 ranges")
    with Image.open(tmp_path / "depth.png") as picture:
        assert np.unique(np.asarray(picture)).size > 10


def test_a_gif_moves(printed, tmp_path: Path) -> None:
    printed("record_gif.py", tmp_path / "hopper.gif")
    with Image.open(tmp_path / "hopper.gif") as picture:
        assert picture.n_frames > 5
        first = np.asarray(picture.convert("RGB"))
        picture.seek(picture.n_frames - 1)
        assert (first != np.asarray(picture.convert("RGB"))).mean() > 0.01


def test_a_file_is_continued_to_the_bit(printed, tmp_path: Path) -> None:
    assert printed("snapshot_file.py", tmp_path / "moment.snapshot").endswith("equal: True\n")
    assert EnvSnapshot.load(tmp_path / "moment.snapshot").state["steps"] == 30


@pytest.mark.slow
def test_steps_over_ros_repeat(printed) -> None:
    first, again = (printed("steps_over_ros.py").splitlines()[-1] for _ in range(2))
    assert first == again
    assert abs(float(re.findall(r"-?\d\.\d{5,}", first)[0])) < 0.1
