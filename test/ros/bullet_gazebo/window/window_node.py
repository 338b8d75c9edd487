#!/usr/bin/env python3
"""The window in a real browser: the page shows what happens, and what is clicked there happens."""

import io
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
from controller_manager_msgs.srv import LoadController, SwitchController
from gazebo_msgs.srv import (
    DeleteModel,
    GetJointProperties,
    GetPhysicsProperties,
    GetWorldProperties,
    SpawnModel,
    SpawnModelRequest,
)
from PIL import Image
from std_srvs.srv import Empty

sys.path.append(str(Path(__file__).resolve().parents[3] / "support"))

from browser import BOUND, Browser, find_browser, wait_for

BALL = """<robot name="ball"><link name="ball">
<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><sphere radius="0.2"/></geometry>
  <material name="r"><color rgba="1 0 0 1"/></material></visual>
<visual><geometry><mesh filename="file://{mesh}"/></geometry></visual></link></robot>"""
NOTICES = 160  # [pixels] from above that notices may take, and give back
STATES = "joint_state_controller"
# The lengths of all charts' data, as viser's page offers them to tests.
CHARTS = """Object.values((window.__viserTestpoints || {}).uplots || {})
  .map(each => each.chart.data[0].length)"""
ODD = "<b>ö\t\"&'/x"


def proxy(name, kind):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind)


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
class WindowTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.spawn = staticmethod(proxy("/gazebo/spawn_urdf_model", SpawnModel))
        cls.delete = staticmethod(proxy("/gazebo/delete_model", DeleteModel))
        cls.physics = staticmethod(proxy("/gazebo/get_physics_properties", GetPhysicsProperties))
        cls.world = staticmethod(proxy("/gazebo/get_world_properties", GetWorldProperties))
        xml = rospy.get_param("/robot_description")
        request = SpawnModelRequest(model_name="cartpole", model_xml=xml, robot_namespace="/")
        assert cls.spawn(request).success
        cls.window = Output("rosrun", "gazebo_ros", "gzclient", "--no-browser")
        url = cls.window.line("is the page").rpartition(" ")[2]
        cls.page = Browser(url)
        cls.page.__enter__()
        cls.page.wait_for_text("One step")

    @classmethod
    def tearDownClass(cls):
        cls.page.__exit__()
        assert cls.window.close() == 0, cls.window.lines

    def view(self):
        """Red, green and blue (3, n) of the picture's pixels, without the panel beside it and notices."""
        pixels = np.asarray(Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")).astype(
            int
        )
        return pixels[NOTICES:, : pixels.shape[1] * 2 // 3].reshape(-1, 3).T

    def red(self):
        """How many pixels are those of the ball."""
        red, green, blue = self.view()
        return int(((red > 120) & (np.maximum(green, blue) < red / 3)).sum())

    def yellow(self):
        """How many pixels are those of joints' axes."""
        red, green, blue = self.view()
        return int(((red > 180) & (green > 150) & (blue < 110)).sum())

    def test_models_come_and_go(self):
        self.page.click("Models")
        self.page.wait_for_text("cartpole")
        self.assertLess(self.red(), 50)
        with tempfile.TemporaryDirectory() as folder:
            mesh = Path(folder, "broken.stl")
            mesh.write_bytes(b"solid nothing of the kind")
            for name in ("ball", ODD):
                self.comes_and_goes(name, mesh)

    def comes_and_goes(self, name, mesh):
        told = " ".join(name.split())
        request = SpawnModelRequest(model_name=name, model_xml=BALL.format(mesh=mesh))
        request.initial_pose.position.z = 0.6
        answer = self.spawn(request)
        self.assertTrue(answer.success, answer.status_message)
        self.page.wait_for_text(told)
        wait_for(lambda: self.red() > 1000, "ball in the picture")
        self.assertIn("broken.stl", self.window.line(f"'{told}', link 'ball', visual"))
        self.assertTrue(self.delete(name).success)
        wait_for(lambda: told not in self.page.text, "deletion")
        wait_for(lambda: self.red() < 50, "picture without the ball")

    def test_time_is_moved_by_clicks(self):
        self.page.click("World")
        self.page.click("Go on")
        wait_for(lambda: not self.physics().pause, "time that runs")
        self.page.click("Pause")
        wait_for(lambda: self.physics().pause, "pause")
        self.page.click("Reset simulation")
        wait_for(lambda: self.world().sim_time == 0.0, "time zero")
        self.page.click("One step")
        wait_for(lambda: round(self.world().sim_time, 6) == 0.001, "step")
        self.page.click("Do these steps")
        wait_for(lambda: round(self.world().sim_time, 6) == 0.101, "hundred steps")
        self.page.wait_for_text("0.101 s")

    def test_a_slider_places_a_joint_of_a_paused_world(self):
        self.page.click("Models")
        self.page.choose("(none)", "cartpole")
        joint = proxy("/gazebo/get_joint_properties", GetJointProperties)
        self.page.wait_for_text("stand_cart")
        self.page.press_keys("[role=slider]", "ArrowRight", 20)
        wait_for(lambda: joint("stand_cart").position[0] > 0.03, "joint that was placed")
        self.page.choose("cartpole", "(none)")

    def test_controllers_are_shown_with_their_state(self):
        self.page.click("Controllers")
        self.page.wait_for_text("/controller_manager")
        self.assertTrue(proxy("/controller_manager/load_controller", LoadController)(STATES).ok)
        self.page.wait_for_text(f"{STATES}: initialized")
        switch = proxy("/controller_manager/switch_controller", SwitchController)
        self.assertTrue(switch([STATES], [], 2, False, 0.0).ok)
        self.page.wait_for_text(f"{STATES}: running")

    def test_shapes_and_frames_on_demand(self):
        self.page.click("World")
        before = self.yellow()  # the pole is nearly of that colour
        self.page.click("Joint frames")
        wait_for(lambda: self.yellow() > before + 40, "axes of joints")
        self.page.click("Joint frames")
        wait_for(lambda: self.yellow() < before + 20, "picture without axes")
        plain = self.view()
        self.page.click("Collision shapes")
        wait_for(lambda: (self.view() != plain).any(axis=0).sum() > 200, "collision shapes")

    def test_the_curves_of_a_training_beside_the_robot(self):
        with tempfile.TemporaryDirectory() as folder:
            rospy.set_param("/gazebo_gui/curves", folder)
            with Path(folder, "scalars.csv").open("w") as table:
                table.write("step,tag,value,wall_time\n")
                for episodes in (3, 30):
                    table.writelines(
                        f"{10 * step},charts/episodic_return,{step}.5,0\n"
                        for step in range(episodes // 10 * 3, episodes)
                    )
                    table.flush()
                    self.page.wait_for_text("Training")
                    self.page.click("Training")
                    self.page.wait_for_text(f"{episodes} episodes")
            wait_for(lambda: self.page.run(CHARTS) == [30], "chart")
            rospy.delete_param("/gazebo_gui/curves")
        self.page.wait_for_text("the table is gone")

    def test_what_somebody_else_does_is_shown(self):
        self.page.click("World")
        proxy("/gazebo/unpause_physics", Empty)()
        self.page.wait_for_text("real-time factor")
        proxy("/gazebo/pause_physics", Empty)()
        self.page.wait_for_text("paused")


if __name__ == "__main__":
    rospy.init_node("window_test")
    rostest.rosrun("cartpole", "window", WindowTest)
