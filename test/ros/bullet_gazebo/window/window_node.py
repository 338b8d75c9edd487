#!/usr/bin/env python3
"""The window in a real browser: the page shows the world, and its buttons work."""

import io
import os
import tempfile
from pathlib import Path

import numpy as np
import rosgraph
import rospy
import rostest
from arm_cases import ArmTest
from drive_cases import DriveTest
from gazebo_msgs.msg import ModelState
from joints_cases import JointsTest
from PIL import Image
from shown_robot_cases import ShownRobotTest
from support.pages.browser import wait_for
from support.pages.window_page import BLUE, INERTIAL, RED, YELLOW, WindowCase, count
from support.ros.calls import delete_model, gazebo, position, process_of, sim_time

from bullet_gazebo.common.messages import from_pose_msg
from bullet_gazebo.window.window import CAMERA
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.pictures.camera import ASPECT, THIRD, overview
from robot_sim.pictures.renderer import Renderer
from robot_sim.pictures.visuals import visible_shapes

__all__ = ["ArmTest", "DriveTest", "JointsTest", "ShownRobotTest", "WindowTest"]
BALL = f"""<robot name="ball"><link name="ball">{INERTIAL}
<visual><geometry><sphere radius="0.2"/></geometry>
  <material name="r"><color rgba="1 0 0 1"/></material></visual></link></robot>"""
BROKEN = BALL.replace("</link>", '<visual><geometry><mesh filename="file://{}"/></geometry></visual></link>')
DOOR = f"""<robot name="door"><link name="world"/><link name="frame">{INERTIAL}
<visual><geometry><box size="0.1 0.1 0.8"/></geometry>
  <material name="b"><color rgba="0 0 1 1"/></material></visual></link>
<link name="leaf">{INERTIAL}
<collision><origin xyz="0 0 -0.5"/><geometry><box size="0.6 0.6 1"/></geometry></collision></link>
<joint name="fixed" type="fixed"><parent link="world"/><child link="frame"/><origin xyz="0 0 0.4"/></joint>
<joint name="hinge" type="continuous"><parent link="frame"/><child link="leaf"/><origin xyz="0 0 0.5"/>
<axis xyz="0 0 1"/></joint>
</robot>"""
CRATE = f"""<robot name="crate"><link name="crate">{INERTIAL}
<collision><geometry><box size="0.4 0.4 0.2"/></geometry></collision></link></robot>"""
WALL = """<robot name="wall"><link name="wall">
<collision><geometry><box size="2 0.1 1"/></geometry></collision>
<visual><geometry><box size="2 0.1 1"/></geometry></visual></link>
<gazebo><static>true</static></gazebo></robot>"""
SEEING = f"""<robot name="seeing"><link name="body">{INERTIAL}</link>
<gazebo reference="body">
<sensor name="scanner" type="ray"><pose>0 0 0 0 0 1.57</pose><ray>
  <scan><horizontal><samples>61</samples><min_angle>-1</min_angle><max_angle>1</max_angle></horizontal></scan>
  <range><min>0.1</min><max>5</max></range></ray>
  <plugin name="laser" filename="libgazebo_ros_laser.so"><topicName>/scan</topicName></plugin></sensor>
<sensor name="eye" type="camera"><camera/>
  <plugin name="eye" filename="libgazebo_ros_camera.so"><cameraName>/eye</cameraName></plugin></sensor>
</gazebo><gazebo><static>true</static></gazebo></robot>"""
PICTURES = "[...document.querySelectorAll('img')].filter(e => e.naturalWidth === 320).length"
ODD = "<b>ö\t\"&'/x"
LINKS = ("stand", "cart", "pole")
FEW = 3  # [pixels]
AWAY = (-20.0, 30.0, 0.6)  # [m]; far out of sight


class WindowTest(WindowCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.page.reload()  # its camera looks at what was there first
        cls.page.wait_for_text("One step")

    def place(self, name, where):
        state = ModelState(model_name=name)
        point = state.pose.position
        point.x, point.y, point.z = where
        state.pose.orientation.w = 1.0
        self.assertTrue(gazebo("set_model_state", state).success)

    def test_models_come_and_go(self):
        self.wait_until_gone(RED)
        with tempfile.TemporaryDirectory() as folder:
            mesh = Path(folder, "broken.stl")
            mesh.write_bytes(b"solid nothing of the kind")
            for name in ("ball", ODD):
                told = " ".join(name.split())
                self.spawn(name, BROKEN.format(mesh), z=0.6)
                self.wait_until_seen(RED, 1000)
                self.assertIn("broken.stl", self.window.line(f"'{told}', link 'ball', visual"))
                self.assertTrue(delete_model(name).success)
                wait_for(lambda told=told: told not in self.page.text, "deletion")
                self.wait_until_gone(RED)

    def test_time_is_moved_by_clicks(self):
        self.spawn("ball", BALL, z=0.6)
        self.page.click("World")
        self.page.click("Resume")
        wait_for(lambda: not gazebo("get_physics_properties").pause, "time that runs")
        self.page.click("Pause")
        wait_for(lambda: gazebo("get_physics_properties").pause, "pause")
        self.page.click("Reset simulation")
        wait_for(lambda: sim_time() == 0.0, "time zero")
        self.page.click("One step")
        wait_for(lambda: round(sim_time(), 6) == 0.001, "step")
        self.page.click("Do these steps")
        wait_for(lambda: round(sim_time(), 6) == 0.101, "hundred steps")
        self.page.wait_for_text("0.101 s")
        self.assertLess(position("ball").z, 0.56)
        self.page.click("Reset world")
        wait_for(lambda: position("ball").z == 0.6, "ball where it was")
        self.assertEqual(round(sim_time(), 6), 0.101)

    def test_speed_is_chosen_and_shown(self):
        self.set_speed(1.0)
        self.page.click("World")
        for before, after, factor in (
            ("1 ×", "0.5 ×", 0.5), ("0.5 ×", "unlimited", 0.0), ("unlimited", "1 ×", 1.0)
        ):  # fmt: skip
            self.page.choose(before, after)
            wait_for(lambda factor=factor: self.factor() == factor, f"speed {after}")
        for factor, shown in ((2.0, "2 ×"), (1.3, "other"), (1.0, "1 ×")):  # somebody else sets it
            self.set_speed(factor)
            self.page.wait_for_value(shown)

    def factor(self):
        now = gazebo("get_physics_properties")
        return round(now.max_update_rate * now.time_step, 6)

    def test_frames_and_shapes_on_demand(self):
        self.spawn("door", DOOR)
        self.page.click("World")
        self.wait_until_seen(BLUE, 500)
        self.wait_until_gone(YELLOW)
        self.page.click("Joint frames")
        self.wait_until_seen(YELLOW, 40)
        self.page.click("Joint frames")
        self.wait_until_gone(YELLOW)
        self.page.click("Collision shapes")
        self.wait_until_gone(BLUE)  # it is within the other one
        self.page.click("Collision shapes")
        self.wait_until_seen(BLUE, 500)

    def test_contact_points_on_demand(self):
        self.spawn("crate", CRATE, z=0.1)
        self.page.click("World")
        self.page.click("Do these steps")
        wait_for(lambda: round(sim_time(), 6) == 0.1, "hundred steps")
        self.wait_until_gone(RED)
        self.page.click("Contact points")
        self.wait_until_seen(RED, 20)
        self.page.click("Contact points")
        self.wait_until_gone(RED)

    def test_a_model_is_followed(self):
        self.addCleanup(self.page.wait_for_text, "One step")
        self.addCleanup(self.page.reload)
        self.spawn("ball", BALL, z=0.6)
        self.wait_until_seen(RED, 1000)
        self.page.wait_for_text("ball (followed)")  # the only one that moves
        self.place("ball", AWAY)
        self.page.wait_for_text("ball (followed)\t-20.000\t30.000\t0.600")
        self.wait_until_seen(RED, 1000)
        self.page.click("Follow")
        self.addCleanup(self.page.click, "Follow")
        wait_for(lambda: "(followed)" not in self.page.text, "end of following")
        self.wait_until_seen(RED, 1000)  # the camera stays with it
        self.place("ball", (0.0, 0.0, 0.6))
        self.wait_until_gone(RED)

    def test_a_scan_and_a_picture_on_demand(self):
        self.spawn("wall", WALL, y=1.0, z=0.5)
        self.spawn("seeing", SEEING, z=0.3)
        self.page.click("Sensors")
        self.page.wait_for_text("/eye/image_raw")
        self.wait_until_gone(RED)
        self.assertEqual(self.watchers("/scan"), [])
        self.page.click("/scan")
        self.wait_until_seen(RED, 40)
        self.assertEqual(self.page.run(PICTURES), 0)
        self.page.click("/scan")
        self.wait_until_gone(RED)
        self.assertEqual(self.watchers("/scan"), [])
        files = self.open_files()
        for _ in range(3):
            for watched in (True, False):
                self.page.click("/scan")
                wait_for(lambda: bool(self.watchers("/scan")) == watched, "subscriber")  # noqa: B023
        wait_for(lambda: self.open_files() <= files + 2, "end of the connections")
        self.wait_until_gone(BLUE)
        self.page.click("/eye/image_raw")
        wait_for(lambda: self.page.run(PICTURES) == 1, "picture")
        self.wait_until_seen(BLUE, 40)  # the frustum
        delete_model("seeing")
        wait_for(lambda: "/eye" not in self.page.text, "end of its sensors")
        self.wait_until_gone(BLUE)

    def open_files(self):
        """How many files the window's process has open."""
        return len(os.listdir(f"/proc/{process_of('/gazebo_gui')}/fd"))

    def watchers(self, topic):
        """The nodes that subscribe to a topic."""
        found = rosgraph.Master("window_test").getSystemState()[1]
        return dict(found).get(topic, [])

    def screenshot(self):
        """What the page's button saves."""
        self.page.click("World")
        with tempfile.TemporaryDirectory() as folder:
            self.page.download_to(folder)
            self.page.click("Screenshot")
            told = Path(folder, "gzclient.png")
            wait_for(told.is_file, "gzclient.png")
            return np.asarray(Image.open(io.BytesIO(told.read_bytes())))

    def test_a_screenshot_is_what_the_page_shows(self):
        self.spawn("ball", BALL, z=0.6)
        self.page.click("World")
        self.wait_until_seen(RED, 1000)
        picture = self.screenshot()
        height, width, parts = picture.shape
        self.assertEqual(parts, 3)
        self.assertEqual([width, height], self.page.run(CANVAS))
        self.assertEqual(picture[0, 0].tolist(), [255, 255, 255])  # the sky
        red = count(picture.reshape(-1, 3).T, RED)
        self.assertAlmostEqual(red / count(self.view(), RED), 1.0, delta=0.1)
        rows = [each for each in range(height) if count(picture[each].T, RED)]
        self.assertAlmostEqual(len(rows) / height, 0.25, delta=0.08)  # its box is about a third

    def test_the_page_shows_what_pictures_without_a_display_show(self):
        xml = rospy.get_param("/robot_description")
        self.spawn("cartpole", xml)
        scene = Renderer()
        self.addCleanup(scene.close)
        scene.add("cartpole", visible_shapes(parse_urdf(xml)))
        self.place_links(scene)
        camera = overview(scene.corners("cartpole"), ASPECT, CAMERA, THIRD)  # of the first moment
        joints = ["stand_cart", "cart_pole"], [0.2, 0.4]
        self.assertTrue(gazebo("set_model_configuration", "cartpole", "", *joints).success)
        self.place_links(scene)
        width, height = self.page.run(CANVAS)
        wanted = boxes(scene.picture(camera, width, height))
        self.assertGreater(wanted[3] - wanted[1], 60)  # the pole's height
        # As soon as the page has heard of the joints' positions
        wait_for(lambda: np.abs(boxes(self.screenshot()) - wanted).max() <= FEW, f"picture with {wanted}")

    def place_links(self, scene):
        """Places the robot in a renderer as the simulator has it."""
        links = {name: gazebo("get_link_state", f"cartpole::{name}", "world") for name in LINKS}
        poses = {name: from_pose_msg(each.link_state.pose) for name, each in links.items()}
        scene.place("cartpole", poses)


def boxes(picture):
    """Left, top, right and bottom [pixels] of what is orange, the pole, and of what is blue, the cart."""
    red, green, blue = np.moveaxis(picture.astype(int), 2, 0)
    edges = []
    for part in (
        (red > green + 20) & (green > blue + 20),
        (blue > green + 20) & (blue > 2 * red),  # the ground is a pale blue
    ):
        rows, columns = np.nonzero(part)
        edges += [columns.min(), rows.min(), columns.max(), rows.max()] if len(rows) else [0] * 4
    return np.array(edges)


CANVAS = """(() => { const canvas = document.querySelector("canvas");
  return [canvas.clientWidth, canvas.clientHeight]; })()"""


if __name__ == "__main__":
    rospy.init_node("window_test")
    rostest.rosrun("cartpole", "window", "__main__")
