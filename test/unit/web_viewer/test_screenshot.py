"""Pictures of pages, as documentation shows them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image
from support.pages.browser import find_browser

TOOL = Path(__file__).resolve().parents[2] / "support/pages/screenshot.py"


@pytest.mark.slow
@pytest.mark.skipif(find_browser() is None, reason="no Chromium: apt-get install chromium")
@pytest.mark.parametrize("size", [(1200, 860), (390, 844)])
def test_a_picture_has_the_size_that_was_asked_for(tmp_path, size):
    page, out = tmp_path / "page.html", tmp_path / "out.png"
    page.write_text("<p>a page")
    options = ["--size", "x".join(map(str, size)), "--settle", "0"]
    here = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run([sys.executable, TOOL, page.as_uri(), out, *options], check=True, env=here)
    with Image.open(out) as picture:
        assert picture.size == size
