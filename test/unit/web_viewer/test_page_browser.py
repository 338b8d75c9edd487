"""A page's layout in a real browser, on a screen and on a telephone; and its first words."""

import json
import threading
import urllib.request
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from support.pages.browser import BOUND, Browser, find_browser, wait_for

from web_viewer.server import ServedPage

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not find_browser(), reason="no Chromium: apt-get install chromium"),
]
PHONE, SCREEN = (390, 844), (1280, 800)
WORDS = "The page is loading"
# Left, top, right and bottom [pixels] of the scene, and of the panel around a button.
BOXES = """(() => {
  const sides = e => { const b = e.getBoundingClientRect(); return [b.x, b.y, b.right, b.bottom]; };
  let panel = [...document.querySelectorAll("button")].find(e => e.innerText.trim() === "Push");
  while (panel && !panel.classList.contains("mantine-Paper-root")) panel = panel.parentElement;
  return JSON.stringify([sides(document.querySelector("canvas")), sides(panel)]);
})()"""
# On the panel's title, which folds and unfolds it.
TAP = """[...document.querySelectorAll("div")]
  .find(e => e.style.cursor === "pointer" && e.innerText.trim() === "a page").click()"""


@pytest.fixture
def page():
    made = ServedPage("a page", (2.0, 2.0, 1.5), (0.0, 0.0, 0.3), port=0)
    server = made.server
    server.scene.add_box("/box", color=(255, 0, 0))
    with server.gui.add_tab_group().add_tab("World"):
        for number in range(30):
            server.gui.add_slider(f"joint {number}", 0.0, 1.0, 0.1, 0.5)
        server.gui.add_button("Push")
    yield made.address.url
    made.close()


def boxes(seen):
    return json.loads(seen.run(BOXES))


def test_a_telephone_shows_the_scene_above_the_panel(page):
    width, height = PHONE
    with Browser(page, size=PHONE) as seen:
        seen.resize(*PHONE)
        seen.wait_for_text("Push")
        wait_for(lambda: boxes(seen)[0][3] > 0, "scene")
        scene, panel = boxes(seen)
        assert scene == pytest.approx([0, 0, width, panel[1]], abs=1)
        assert panel == pytest.approx([0, panel[1], width, height], abs=1)
        assert scene[3] >= 0.5 * height
        seen.run(TAP)
        wait_for(lambda: boxes(seen)[0][3] > 0.9 * height, "scene over a folded panel")
        seen.run(TAP)
        # Below it stands less than at first, where the tabs had not all their lines yet.
        wait_for(lambda: boxes(seen)[0][3] < 0.8 * height, "panel again")


def test_a_screen_shows_the_panel_beside_the_scene(page):
    width, height = SCREEN
    with Browser(page, size=SCREEN) as seen:
        seen.resize(*SCREEN)
        seen.wait_for_text("Push")

        def are_beside() -> bool:
            scene, panel = boxes(seen)
            heights = scene[3] == panel[3] == pytest.approx(height, abs=1)
            at_edge = panel[2] == pytest.approx(width, abs=3)
            return heights and at_edge and 0.7 * width < scene[2] <= panel[0] < panel[2]

        wait_for(are_beside, "panel beside the scene")  # the layout may follow the texts


def test_a_page_of_which_only_the_beginning_has_come_says_that_it_is_loading(page):
    with urllib.request.urlopen(page, timeout=60.0) as answer:
        whole = answer.read()
    come = threading.Event()

    class Slow(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(whole[: len(whole) // 10])
            self.wfile.flush()
            come.wait(2.0 * BOUND)
            self.wfile.write(whole[len(whole) // 10 :])

        def log_message(self, *_words):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Slow) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            with Browser(f"http://127.0.0.1:{server.server_port}/") as seen:
                seen.wait_for_text(WORDS)
                come.set()
                wait_for(lambda: WORDS not in seen.text, "end of the words")
        finally:
            come.set()
            server.shutdown()
            thread.join()
