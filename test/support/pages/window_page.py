"""The window's page in a real browser: start it, click, look."""

import io
import subprocess
import threading
import unittest

import numpy as np
import rospy
from gazebo_msgs.srv import (
    DeleteModel,
    GetPhysicsProperties,
    GetWorldProperties,
    SetPhysicsProperties,
    SpawnModel,
    SpawnModelRequest,
)
from PIL import Image
from std_srvs.srv import Empty
from support.pages.browser import BOUND, Browser, find_browser, wait_for

NOTICES = 160  # [pixels] from above that notices may take, and give back
INERTIAL = """<inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>"""

# What a pixel of a colour is, whatever the light. No two of them are colours of the same thing.
RED = "red"
BLUE = "blue"
YELLOW = "yellow"


def proxy(name, kind):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind)


def count(pixels, color):
    """How many of the pixels (3, n) have a colour."""
    red, green, blue = pixels.astype(int)
    shown = {
        RED: (red > 100) & (np.maximum(green, blue) < red / 2),
        BLUE: (blue > 80) & (np.maximum(red, green) < blue / 2),
        YELLOW: (np.minimum(red, green) > 130) & (blue < np.minimum(red, green) / 2),
    }
    return int(shown[color].sum())


class Output:
    """What a program writes, line by line."""

    def __init__(self, *command):
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
        )
        self.lines = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            self.lines.append(line.rstrip())

    def line(self, text):
        """Returns the first line with `text` in it, once it is there."""
        found = wait_for(
            lambda: (
                [each for each in self.lines if text in each] or self._process.poll() is not None
            ),
            f"line {text!r}",
        )
        assert found is not True, self.lines
        return found[0]

    def close(self):
        self._process.terminate()
        code = self._process.wait(BOUND)
        self._reader.join(BOUND)
        self._process.stdout.close()
        return code


@unittest.skipUnless(find_browser(), "there is no Chromium here: apt-get install chromium")
class WindowCase(unittest.TestCase):
    """A window and its page for all tests of a class; each test has a world of its own making.

    What is waited for is always a state that must come, never a difference to what was seen before.
    """

    keep = ("ground_plane",)  # models that all tests share

    @classmethod
    def setUpClass(cls):
        cls.spawn_urdf = staticmethod(proxy("/gazebo/spawn_urdf_model", SpawnModel))
        cls.delete = staticmethod(proxy("/gazebo/delete_model", DeleteModel))
        cls.physics = staticmethod(proxy("/gazebo/get_physics_properties", GetPhysicsProperties))
        cls.set_physics = staticmethod(
            proxy("/gazebo/set_physics_properties", SetPhysicsProperties)
        )
        cls.world = staticmethod(proxy("/gazebo/get_world_properties", GetWorldProperties))
        cls.reset = staticmethod(proxy("/gazebo/reset_simulation", Empty))
        cls.pause = staticmethod(proxy("/gazebo/pause_physics", Empty))
        cls.unpause = staticmethod(proxy("/gazebo/unpause_physics", Empty))
        cls.window = Output("rosrun", "gazebo_ros", "gzclient", "--no-browser")
        cls.addClassCleanup(cls.window.close)
        url = cls.window.line("is the page").rpartition(" ")[2]
        cls.page = cls.enterClassContext(Browser(url))
        cls.page.wait_for_text("One step")

    def setUp(self):
        self.pause()
        for name in self.world().model_names:
            if name not in self.keep:
                self.delete(name)
        self.reset()

    def spawn(self, name, xml, **position):
        """Spawns a model, and has the page show it before the test goes on."""
        request = SpawnModelRequest(model_name=name, model_xml=xml)
        for axis, value in position.items():
            setattr(request.initial_pose.position, axis, value)
        answer = self.spawn_urdf(request)
        self.assertTrue(answer.success, answer.status_message)
        self.page.click("Models")
        self.page.wait_for_text(" ".join(name.split()))

    def set_speed(self, factor):
        """Sets the real-time factor that is aimed at; 0 is as fast as possible."""
        now = self.physics()
        rate = factor / now.time_step
        self.assertTrue(self.set_physics(now.time_step, rate, now.gravity, now.ode_config).success)

    def view(self):
        """Red, green and blue (3, n) of the picture's pixels, without the panel beside it and notices."""
        pixels = np.asarray(Image.open(io.BytesIO(self.page.screenshot())).convert("RGB"))
        return pixels[NOTICES:, : pixels.shape[1] * 2 // 3].reshape(-1, 3).T

    def wait_until_seen(self, color, pixels):
        """Waits until more than `pixels` of the picture have a colour."""
        wait_for(
            lambda: count(self.view(), color) > pixels, f"{color} of more than {pixels} pixels"
        )

    def wait_until_gone(self, color):
        """Waits until nothing of the picture has a colour."""
        wait_for(lambda: count(self.view(), color) == 0, f"picture without {color}")
