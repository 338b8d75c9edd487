"""The window's page in a real browser: start it, click, look."""

import atexit
import functools
import io
import unittest

import numpy as np
from PIL import Image
from support.pages.browser import Browser, Output, find_browser, wait_for
from support.ros.calls import delete_model, gazebo, model_names, spawn_model

NOTICES = 160  # [pixels] from above that notices may take, and give back
INERTIAL = """<inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>"""

# What a pixel of a colour is, whatever the light. No two of them are colours of the same thing.
RED = "red"
BLUE = "blue"
YELLOW = "yellow"


def count(pixels, color):
    """How many of the pixels (3, n) have a colour."""
    red, green, blue = pixels.astype(int)
    shown = {
        RED: (red > 100) & (np.maximum(green, blue) < red / 2),
        BLUE: (blue > 80) & (np.maximum(red, green) < blue / 2),
        YELLOW: (np.minimum(red, green) > 130) & (blue < np.minimum(red, green) / 2),
    }
    return int(shown[color].sum())


class Shown:
    """A window, and its page in a browser."""

    def __init__(self):
        self.window = Output("rosrun", "gazebo_ros", "gzclient", "--no-browser")
        self.url = self.window.url
        self.page = Browser(self.url).__enter__()
        atexit.register(self.close)
        self.page.wait_for_text("One step")

    def close(self):
        self.page.__exit__()
        self.window.close()


@functools.cache
def shown():
    """The one that all tests of this process share: drawn by software, a page takes long to come."""
    return Shown()


@unittest.skipUnless(find_browser(), "there is no Chromium here: apt-get install chromium")
class WindowCase(unittest.TestCase):
    """A window and its page for all tests; each test has a world of its own making.

    What is waited for is always a state that must come, never a difference to what was seen before.
    """

    keep = ("ground_plane",)  # models that all tests of a class share

    @classmethod
    def setUpClass(cls):
        cls.window, cls.page = shown().window, shown().page

    def setUp(self):
        gazebo("pause_physics")
        for name in model_names():
            if name not in self.keep:
                delete_model(name)
        gazebo("reset_simulation")

    def spawn(self, name, xml, **place):
        """Spawns a model, and has the page show it before the test goes on."""
        answer = spawn_model(name, xml, "", **place)
        self.assertTrue(answer.success, answer.status_message)
        self.page.click("Models")
        self.page.wait_for_text(" ".join(name.split()))

    def set_speed(self, factor):
        """Sets the real-time factor that is aimed at; 0 is as fast as possible."""
        now = gazebo("get_physics_properties")
        fields = now.time_step, factor / now.time_step, now.gravity, now.ode_config
        self.assertTrue(gazebo("set_physics_properties", *fields).success)

    def view(self):
        """Red, green and blue (3, n) of the picture's pixels, without the panel beside it and notices."""
        pixels = np.asarray(Image.open(io.BytesIO(self.page.screenshot())).convert("RGB"))
        return pixels[NOTICES:, : pixels.shape[1] * 2 // 3].reshape(-1, 3).T

    def wait_until_seen(self, color, pixels):
        """Waits until more than `pixels` of the picture have a colour."""
        wait_for(lambda: count(self.view(), color) > pixels, f"{color} of more than {pixels} pixels")

    def wait_until_gone(self, color):
        """Waits until nothing of the picture has a colour."""
        wait_for(lambda: count(self.view(), color) == 0, f"picture without {color}")
