"""Episodes as films: which frames, how long they last, what stands below them, and several at once."""

import ctypes.util
import os
from argparse import Namespace
from io import BytesIO
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from PIL import Image
from support.pages import viser_recording
from support.pages.browser import Browser, find_browser, wait_for
from support.pages.pictures import pixel
from support.training.workbench_runs import record as bare_run

import cartpole  # noqa: F401 - registers the environments
from cartpole.environment import CAMERA
from rl_workbench import cli
from rl_workbench.tools.policies import Player
from rl_workbench.tools.record import Film, SideBySide, _write_scene, write_video
from rl_workbench.tools.recording import PictureView, draw_without_display, record_episode

RATE = 40.0  # [Hz]
HEIGHT = 0.5  # [m] of the robot above the ground, in this task
NEAR = 4.0  # [pixels]
CART = 0.15  # [m] above the robot's foot
SEEK = ".mantine-NumberInput-input"


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


def film(length: int, title: str = "", stride: float = 1.0, max_steps: int = 0) -> Film:
    env = Counter(length)
    view, limits = PictureView(env), {"stride": stride, "max_steps": max_steps}
    frames = record_episode(env, lambda _: np.zeros(4, np.float32), view, 0, **limits)
    return Film(title, list(frames), RATE / stride)


@pytest.mark.parametrize(
    ("stride", "steps"),
    [
        (1.0, list(range(9))),
        (2.0, [0, 2, 4, 6, 8]),
        (2.5, [0, 3, 5, 8]),
        (40 / 12, [0, 4, 7, 8]),  # the last one is always there
    ],
)
def test_frames_come_at_the_stride_that_was_asked_for(stride, steps):
    made = film(8, stride=stride)
    assert [frame.step for frame in made.frames] == steps
    sheets = SideBySide([made], captions=False)
    assert [int(frame[0, 0, 0]) // 10 for frame in sheets][:-1] == steps[:-1]
    assert made.frames[-1].total_reward == 4.0


def test_an_episode_is_cut_off_where_one_wants():
    assert film(8, max_steps=3).frames[-1].step == 3


def test_episodes_side_by_side_wait_for_the_longest():
    sheets = SideBySide([film(9, max_steps=2), film(9, max_steps=5)], captions=False)
    assert len(sheets) == 6
    assert [frame[0, 0, 0] for frame in sheets] == [0, 10, 20, 20, 20, 20]
    assert [frame[0, 400, 0] for frame in sheets] == [0, 10, 20, 30, 40, 50]


def test_an_episode_that_has_ended_is_marked_and_one_that_is_cut_off_is_not():
    whole, cut = film(3), film(8, max_steps=3)
    assert [each.frames[-1].ended for each in (whole, cut)] == [True, False]
    assert not any(each.ended for each in whole.frames[:-1])
    paled, plain = (SideBySide([each], captions=False)[3] for each in (whole, cut))
    assert plain.max() == 30 < paled.min()
    assert cut.frames[-1].caption() == "step 3   return 1.5   action +0.00 +0.00 +0.00 ..."


def test_captions_stand_below_the_picture_and_change_with_it():
    first, *_, last = SideBySide([film(3, title="best")], captions=True)
    high, *_ = SideBySide([film(3)], captions=False)
    assert first.shape[1:] == high.shape[1:] and first.shape[0] > high.shape[0]
    lines = [frame[high.shape[0] :] for frame in (first, last)]
    assert all((line < 128).any() for line in lines) and (lines[0] != lines[1]).any()
    assert all((line[:, -1] == 255).all() for line in lines)  # it fits in


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


def record(run: Path, out: Path, *words: str) -> int:
    return cli.main(["record", str(run), "--out", str(out), "--max-steps", "20", *words])


@pytest.mark.slow
def test_best_last_and_random_side_by_side(robot_run: Path, tmp_path: Path, capsys):
    out = tmp_path / "three.gif"
    words = ("--checkpoint", "best", "last", "random", "--size", "64x48", "--fps", "10")
    assert record(robot_run, out, *words) == 0
    with Image.open(out) as video:
        assert video.size == (3 * 64, 48 + 8)
        assert video.info["duration"] == 100
    first, *told = capsys.readouterr().out.splitlines()
    assert first == f"recording best, last, random of {robot_run}"
    assert [line.split(":")[0] for line in told] == ["best", "last", "random", str(out)]


def test_the_camera_is_placed_by_its_fields(robot_run: Path, tmp_path: Path):
    words = ("--max-steps", "1", "--size", "64x48", "--camera")
    seen = []
    for name, fields in (("a.gif", ("distance=2",)), ("b.gif", ("yaw=104", "target=[0,0,0.3]"))):
        assert record(robot_run, tmp_path / name, *words, *fields) == 0
        with Image.open(tmp_path / name) as video:
            seen.append(np.asarray(video.convert("RGB"))[:48])
    assert (seen[0] != seen[1]).any()


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


@pytest.mark.parametrize(
    ("name", "flags", "text"),
    [
        ("a.gif", ("--fps=100",), "at most 50 frames a second"),  # browsers would slow it down
        ("a.gif", ("--camera", "jaw=1"), "a camera has no 'jaw'; it has target, distance, yaw"),
        ("a.html", ("--size=64x48",), "as large as the browser's window"),
    ],
)
def test_what_a_file_cannot_be_is_refused(robot_run: Path, tmp_path, refused, name, flags, text):
    assert text in refused("record", robot_run, "--out", tmp_path / name, *flags)


def test_a_page_holds_all_that_it_shows(tmp_path: Path):
    path = tmp_path / "a.html"
    frames = [np.full((20, 30, 3), 40 * step, np.uint8) for step in range(5)]
    write_video(path, frames, 12.5)
    text = path.read_text()
    assert 'src="http' not in text and 'href="http' not in text
    found = viser_recording.of_page(text)
    assert found.duration == pytest.approx(5 / 12.5)
    nodes = [found.at(step / 12.5)["/picture"] for step in range(5)]
    levels = [np.asarray(Image.open(BytesIO(bytes(each["_data"])))).mean() for each in nodes]
    assert levels == pytest.approx([0, 40, 80, 120, 160], abs=3)


class Narrow(Counter):
    """One with a size of its own choice."""

    def __init__(self, width: int = 400, height: int = 60, render_mode: str = "rgb_array") -> None:
        if width > 500:
            raise ValueError(f"{width} pixels are too wide for this one")
        super().__init__(3, render_mode)


def test_a_size_that_an_environment_refuses_is_said(tmp_path: Path, refused):
    gymnasium.register("Narrow-v0", Narrow)
    run = bare_run(tmp_path / "run", [1.0], env_id="Narrow-v0")
    words = ("--checkpoint=random", "--size=600x60", "--out", tmp_path / "a.gif")
    assert "600 pixels are too wide for this one" in refused("record", run, *words)


def test_an_environment_without_a_size_has_its_pictures_scaled(tmp_path: Path):
    gymnasium.register("Counter-v0", Counter)
    run = bare_run(tmp_path / "run", [1.0], env_id="Counter-v0")
    assert record(run, tmp_path / "a.gif", "--checkpoint", "random", "--size", "100x30") == 0
    with Image.open(tmp_path / "a.gif") as video:
        assert video.size == (100, 30 + 8)


def test_a_robots_page_is_in_3d_and_holds_all_that_it_shows(robot_run: Path, tmp_path, capsys):
    out = tmp_path / "a.html"
    assert record(robot_run, out) == 0
    steps = int(capsys.readouterr().out.split(" steps")[0].split()[-1])
    text = out.read_text()
    assert len(text) < 1_000_000
    assert 'src="http' not in text and 'href="http' not in text
    found = viser_recording.of_page(text)
    frames = len({time for time, _ in found.messages})
    assert frames == pytest.approx(steps / 5, abs=1.1)  # 125 steps a second, 25 frames
    assert found.duration == pytest.approx(1.0 + (frames - 1) / 25)
    labels = {when: found.at(when)["/caption0"]["text"] for when in (0.0, found.duration)}
    assert labels[0.0].startswith("step 0   return 0.0")
    assert labels[found.duration].startswith(f"step {steps}   return {steps:.1f}   action ")
    before, after = ([part["wxyz"] for part in found.parts(when)] for when in (0.0, 9e9))
    assert before != after


def test_several_are_seen_beside_each_other(robot_run: Path, tmp_path: Path, capsys):
    out = tmp_path / "a.html"
    assert record(robot_run, out, "--checkpoint", "best", "last", "random", "--fps", "10") == 0
    first, *told = capsys.readouterr().out.splitlines()
    assert first == f"recording best, last, random of {robot_run}"
    assert [line.split(":")[0] for line in told] == ["best", "last", "random", str(out)]
    nodes = viser_recording.of_page(out.read_text()).at()
    captions = [nodes[f"/caption{number}"]["text"] for number in range(3)]
    assert [each.split()[0] for each in captions] == ["best", "last", "random"]


def cart(page: Browser, height: int) -> np.ndarray:
    """Column and row [pixels] of the blue cart, above the player's bar; infinite where there is none."""
    picture = Image.open(BytesIO(page.screenshot())).convert("RGB")
    red, _, blue = np.asarray(picture)[:height].astype(int).transpose(2, 0, 1)
    seen = blue > 1.5 * red + 30
    seen[:, : picture.width // 8] = False  # the page's own axes
    return np.argwhere(seen)[:, ::-1].mean(axis=0) if seen.any() else np.full(2, np.inf)


@pytest.mark.slow
@pytest.mark.skipif(not find_browser(), reason="no Chromium: apt-get install chromium")
def test_a_browser_plays_it_without_any_network(tmp_path: Path):
    places: list[float] = []
    camera = CAMERA.at((*CAMERA.target[:2], CAMERA.target[2] + HEIGHT))

    def right(observation: np.ndarray) -> list[float]:
        places.append(float(observation[0]))
        return [1.0]

    path = tmp_path / "episode.html"
    env = gymnasium.make("cartpole/SwingUp-v0", noise=0.0)
    arguments = Namespace(
        out=path, size=None, checkpoint=["best"], seed=0, max_steps=31, no_captions=True
    )
    _write_scene(arguments, {"best": Player(right, env)}, 125.0)
    env.close()
    with Browser(path.as_uri(), offline=True, size=(640, 400)) as page:
        wait_for(lambda: page.run(f"!!document.querySelector({SEEK!r})"), "player")
        canvas = "document.querySelector('canvas')"
        width, height = page.run(f"[{canvas}.clientWidth, {canvas}.clientHeight]")
        for step in (15, 0, 30):
            wanted = pixel(camera, (places[step], 0.0, HEIGHT + CART), width, height)
            page.type(SEEK, f"{step * 0.008 + 0.001:.4f}")
            wait_for(lambda at=wanted: np.abs(cart(page, height) - at).max() < NEAR, f"step {step}")
        assert all(each.startswith(("file:", "data:", "blob:")) for each in page.requests)
        assert page.requests
    across = [pixel(camera, (place, 0.0, HEIGHT), width, height)[0] for place in places]
    assert across[15] - across[0] > 2.0 * NEAR and across[30] - across[15] > 2.0 * NEAR


@pytest.mark.parametrize(
    ("library", "display", "renderer"),
    [("libEGL.so.1", "", "egl"), (None, "", None), ("libEGL.so.1", ":0", None)],
)
def test_mujoco_draws_by_egl_where_it_is_and_no_display(monkeypatch, library, display, renderer):
    """MuJoCo can't be imported where MUJOCO_GL names a library that isn't there."""
    monkeypatch.setattr(os, "environ", {"DISPLAY": display})
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: library)
    draw_without_display()
    assert os.environ.get("MUJOCO_GL") == renderer
