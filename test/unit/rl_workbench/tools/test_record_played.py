"""The file of an episode in 3-D, in a real browser without any network."""

import io
from argparse import Namespace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from PIL import Image
from support.pages.browser import Browser, find_browser, wait_for
from support.pages.pictures import pixel

import cartpole  # noqa: F401 - registers the environments
from cartpole.environment import CAMERA
from rl_workbench.tools.policies import Player
from rl_workbench.tools.record import _write_scene

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not find_browser(), reason="there is no Chromium: apt-get install chromium"),
]
HEIGHT = 0.5  # [m] of the robot above the ground, in this task
NEAR = 4.0  # [pixels]
CART = 0.15  # [m] above the robot's foot
SEEK = ".mantine-NumberInput-input"


def cart(page: Browser, height: int) -> np.ndarray:
    """Column and row [pixels] of the blue cart, above the player's bar; infinite where there is none."""
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    red, _, blue = np.asarray(picture)[:height].astype(int).transpose(2, 0, 1)
    seen = blue > 1.5 * red + 30
    seen[:, : picture.width // 8] = False  # the page's own axes
    return np.argwhere(seen)[:, ::-1].mean(axis=0) if seen.any() else np.full(2, np.inf)


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
