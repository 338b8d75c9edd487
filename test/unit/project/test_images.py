"""The pictures of the documentation. That links to them lead somewhere: `./ws check links`."""

import re
from pathlib import Path

from PIL import Image

LARGEST = 200_000  # [bytes] of a picture on the first page
PICTURE = re.compile(r"!\[[^\]]*\]\(([^)\s]+)\)")


def pictures(page: Path) -> set[Path]:
    found = PICTURE.findall(page.read_text(encoding="utf-8"))
    return {(page.parent / name).resolve() for name in found}


def test_the_first_page_shows_the_robot_the_page_and_tensorboard_and_is_there_at_once(root):
    shown = pictures(root / "README.md")
    assert {"balancing.gif", "page.png", "tensorboard.png"} <= {path.name for path in shown}
    too_large = {path.name: path.stat().st_size for path in shown if path.stat().st_size > LARGEST}
    assert not too_large
    for path in shown:
        with Image.open(path) as picture:
            picture.load()
            assert path.suffix != ".gif" or picture.n_frames > 20


def test_every_picture_is_shown_somewhere(root):
    pages = [root / "README.md", *root.glob("docs/**/*.md")]
    shown = set().union(*map(pictures, pages))
    assert {path.resolve() for path in root.glob("docs/images/*")} - shown == set()
