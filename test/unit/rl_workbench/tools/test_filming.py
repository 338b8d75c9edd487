"""Episodes as films: which frames, how long they last, what stands below them, and several at once."""

import base64
import re
from io import BytesIO
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from PIL import Image

import cartpole  # noqa: F401 - registers the environments
from rl_workbench import cli
from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.pictures import filming
from rl_workbench.tools.pictures.videos import write_video

pytestmark = pytest.mark.usefixtures("signals")
RATE = 40.0  # [Hz]


class Counter(gymnasium.Env):
    """Its pictures are as bright as the episode is long."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": RATE}
    observation_space = gymnasium.spaces.Box(0.0, 1.0, (1,))
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (4,))

    def __init__(self, length: int = 20, render_mode: str = "rgb_array") -> None:
        self.render_mode = render_mode
        self._length, self._step = length, 0

    def reset(self, *, seed=None, options=None):
        self._step = 0
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self._step += 1
        return np.zeros(1, np.float32), 0.5, self._step == self._length, False, {}

    def render(self):
        return np.full((60, 400, 3), 10 * self._step, np.uint8)


def film(length: int, fastest: float, title: str = "", **options) -> filming.Film:
    player = filming.Player(title, Counter(length), lambda _: np.zeros(4, np.float32))
    return filming.film_episode(player, 0, fastest, **options)


def brightness(films: list[filming.Film]) -> list[int]:
    return [int(frame[0, 0, 0]) // 10 for frame in filming.SideBySide(films)]


@pytest.mark.parametrize(
    ("fastest", "rate", "steps"),
    [
        (100.0, 40.0, list(range(9))),
        (20.0, 20.0, [0, 2, 4, 6, 8]),
        (16.0, 16.0, [0, 3, 5, 8]),  # every 2.5 steps
        (12.0, 12.0, [0, 4, 7, 8]),  # the last one is always there
    ],
)
def test_frames_come_at_the_rate_that_was_asked_for(fastest, rate, steps):
    made = film(8, fastest, captions=False)
    assert brightness([made]) == steps
    assert (made.rate, made.end.length, made.end.total_reward) == (rate, 8, 4.0)


def test_an_episode_is_cut_off_where_one_wants():
    assert film(8, RATE, longest=3).end.length == 3


def test_episodes_side_by_side_wait_for_the_longest():
    sheets = filming.SideBySide([film(2, RATE), film(5, RATE)])
    assert len(sheets) == 6
    assert [frame[0, 0, 0] for frame in sheets] == [0, 10, 20, 20, 20, 20]
    assert [frame[0, 400, 0] for frame in sheets] == [0, 10, 20, 30, 40, 50]
    with pytest.raises(IndexError):
        sheets[6]


def test_captions_stand_below_the_picture_and_change_with_it():
    plain, told = film(3, RATE, captions=False), film(3, RATE, title="best")
    (first, *_, last), (high, *_) = filming.SideBySide([told]), filming.SideBySide([plain])
    assert first.shape[1:] == high.shape[1:] and first.shape[0] > high.shape[0]
    lines = [frame[high.shape[0] :] for frame in (first, last)]
    assert all((line < 128).any() for line in lines) and (lines[0] != lines[1]).any()
    assert all((line[:, -1] == 255).all() for line in lines)  # it fits in


@pytest.mark.parametrize(
    ("action", "text"),
    [(np.int64(1), "1"), (np.array([0.5, -0.25], np.float32), "+0.50 -0.25"),
     (np.zeros(5), "+0.00 +0.00 +0.00 ..."), (np.array([1, 0]), "1 0")],
)  # fmt: skip
def test_actions_of_any_kind_are_told(action, text):
    assert filming._caption("last", 7, 3.25, action) == (
        f"last   step 7   return 3.2   action {text}"
    )


def test_a_gifs_frames_last_as_long_as_they_should_on_average(tmp_path: Path):
    path = tmp_path / "a.gif"
    frames = [np.full((8, 8, 3), 2 * step, np.uint8) for step in range(90)]
    write_video(path, frames, 30.0)
    with Image.open(path) as video:
        total = 0
        for index in range(video.n_frames):
            video.seek(index)
            total += video.info["duration"]
    assert total == 3000  # [ms]


def test_sizes_go_to_environments_that_know_them():
    assert filming.size_options("cartpole/Classic-v0", (64, 48)) == {"width": 64, "height": 48}
    assert filming.size_options("CartPole-v1", (64, 48)) == {}
    assert filming.size_options("cartpole/Classic-v0", None) == {}


def test_an_environment_that_draws_nothing_is_refused():
    class Blind(Counter):
        def render(self):
            return None

    with pytest.raises(WorkbenchError, match="draws no pictures"):
        filming.film_episode(filming.Player("", Blind(), lambda _: np.zeros(4)), 0, RATE)


def record(run: Path, out: Path, *words: str) -> int:
    return cli.main(["record", str(run), "--out", str(out), "--max-steps", "20", *words])


def test_best_last_and_random_side_by_side(robot_run: Path, tmp_path: Path, capsys):
    out = tmp_path / "three.gif"
    words = ("--checkpoint", "best", "last", "random", "--size", "64x48", "--fps", "10")
    assert record(robot_run, out, *words) == 0
    with Image.open(out) as video:
        assert video.size == (3 * 64, 48 + 8)
        assert video.info["duration"] == 100
    told = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in told] == ["best", "last", "random", str(out)]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--size", "64"), "must be WIDTHxHEIGHT"),
        (("--size", "1x1"), "must be WIDTHxHEIGHT"),
        (("--fps", "0"), "must lie between"),
        (("--checkpoint", "worst"), "invalid choice"),
    ],
)
def test_flags_that_make_no_sense(robot_run: Path, tmp_path: Path, capsys, words, text):
    with pytest.raises(SystemExit):
        record(robot_run, tmp_path / "a.gif", *words)
    assert text in capsys.readouterr().err


def test_a_gif_that_browsers_would_slow_down_is_refused(robot_run: Path, tmp_path: Path, capsys):
    assert record(robot_run, tmp_path / "a.gif", "--fps", "100") == 1
    assert "50 frames a second at most" in capsys.readouterr().err


def test_a_page_holds_all_that_it_shows(tmp_path: Path):
    path = tmp_path / "a.html"
    frames = [np.full((20, 30, 3), 40 * step, np.uint8) for step in range(5)]
    write_video(path, frames, 12.5)
    text = path.read_text()
    kept = re.findall(r'^"([A-Za-z0-9+/=]+)",$', text, re.MULTILINE)
    levels = [np.asarray(Image.open(BytesIO(base64.b64decode(each)))).mean() for each in kept]
    assert levels == pytest.approx([0, 40, 80, 120, 160], abs=3)
    assert "const rate = 12.5;" in text and 'width="30" height="20"' in text
    assert "@" not in re.sub(r'"[A-Za-z0-9+/=]+"', "", text) and "http" not in text
