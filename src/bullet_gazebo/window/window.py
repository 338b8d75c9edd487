"""The page: shows the scene, and passes clicks to the simulator."""

import contextlib
import io
import threading
import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
from typing import Any

import numpy as np
import rosgraph
import rospy
import viser
from bullet_gazebo_msgs.msg import SceneContacts, ScenePoses
from PIL import Image

from bullet_gazebo.clients.gz import ControlFailed
from bullet_gazebo.scene import from_light, from_model
from bullet_gazebo.window.drive_panel import DrivePanel
from bullet_gazebo.window.model_panel import ModelPanel
from bullet_gazebo.window.panels import Controllers, TimePanel
from bullet_gazebo.window.remote_scene import Commands, RemoteScene
from bullet_gazebo.window.sensor_panel import SensorPanel
from robot_sim.pictures.camera import ASPECT, THIRD, Camera, overview
from robot_sim.pictures.page import Picture
from robot_sim.pictures.page_batches import NUMBERS
from ros_calls.service import ServiceFailed
from web_viewer.server import ServedPage

TITLE = "gzclient"
CAMERA = Camera((0.0, 0.0, 0.35), 2.5, yaw=36.0, pitch=-18.0, view=75.0)  # while nothing moves
UNTOUCHED, UNKNOWN = 1e-3, (3.0, 3.0, 3.0)  # [m]; viser's, before a browser has told its camera
ADVICE = "~window"  # parameter: the lines that say where the page is
WAIT = 0.5  # [s] for a message
OFTEN, SELDOM = 0.25, 2.0  # [s] between updates of texts, controllers
NOTICE = 8.0  # [s] that a fault is shown
RENDERING = 30.0  # [s] for a browser to draw a screenshot
WORLD = "/world"  # the scene node above all models
NOTHING = SceneContacts()


class Window:
    """Draws in the thread that calls `run`; clicks come in threads of viser's."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._scene = RemoteScene()
        world = server.scene.add_frame(WORLD, show_axes=False)
        self._picture = Picture(server, rospy.logwarn, below=WORLD)
        self._version: int | None = None  # of the scene on the page
        self._redraw = threading.Event()  # everything, with other options
        self._newest: ScenePoses | None = None
        self._aimed: set[int] = set()  # numbers of models
        commands = Commands(self._scene.node)
        self._controllers = Controllers()
        gui = server.gui
        tabs = gui.add_tab_group()
        with tabs.add_tab("World"):
            self._time = TimePanel(gui, commands, self.attempt)
            with gui.add_folder("Show"):
                self._collisions = gui.add_checkbox("Collision shapes", False)
                self._joint_frames = gui.add_checkbox("Joint frames", False)
                self._contacts = gui.add_checkbox("Contact points", False)
            gui.add_button("Screenshot", icon=viser.Icon.CAMERA).on_click(self._screenshot)
        with tabs.add_tab("Models"):
            self._models = ModelPanel(
                server, world, commands, self._controllers, self.attempt, lambda: self._time.stands
            )
        with tabs.add_tab("Controllers"):
            self._tree = gui.add_html("")
        with tabs.add_tab("Drive"):
            self._drive = DrivePanel(gui, self._models)
        with tabs.add_tab("Sensors"):
            self._sensors = SensorPanel(server, WORLD)
        for box in (self._collisions, self._joint_frames):
            box.on_update(lambda _: self._redraw.set())
        self._due = {self._show_texts: 0.0, self._show_rest: 0.0}  # [s of wall time]

    def attempt(self, act: Callable[[], None]) -> None:
        """Carries out a click; shows a fault on the page and in the log."""
        try:
            act()
        except (ServiceFailed, ControlFailed, rospy.ROSException) as fault:
            rospy.logwarn("The window: %s", fault)
            for client in self._server.get_clients().values():
                client.add_notification("It wasn't done", str(fault), auto_close_seconds=NOTICE, color="red")

    def run(self) -> None:
        """Shows the world until the node is shut down."""
        while not rospy.is_shutdown():
            watched = bool(self._server.get_clients())
            self._scene.look(watched, watched and self._contacts.value)
            self._sensors.listen(watched)
            poses, contacts = self._scene.wait(WAIT)
            if not watched:
                continue
            try:
                if poses is not None:
                    self._show(poses)
                contacts = contacts if self._contacts.value else NOTHING
                if contacts is not None:  # else the old ones stay
                    self._picture.touch(np.array(contacts.points).reshape(-1, 3))
                self._update(self._show_texts, OFTEN)
                self._update(self._show_rest, SELDOM)
            except (ServiceFailed, rosgraph.MasterException, OSError) as fault:
                rospy.logdebug("the simulator doesn't answer: %s", fault)

    def _show(self, poses: ScenePoses) -> None:
        if self._redraw.is_set():
            self._redraw.clear()
            self._picture.clear()
            self._version = None
        if poses.version != self._version:
            scene = self._scene.get(list(self._picture.models), self._collisions.value)
            self._picture.draw(
                [from_model(each) for each in scene.models],
                [from_light(each) for each in scene.lights],
                self._joint_frames.value,
            )
            self._models.set_models(list(self._picture.models.values()))
            self._sensors.set_sensors(scene.sensors)
            self._version = scene.version
        if poses.version == self._version:
            self._newest = poses
            with self._server.atomic():
                self._picture.move(np.array(poses.poses, dtype=float).reshape(-1, NUMBERS))
                self._models.follow(self._picture.links)
                self._models.at = self._picture.joints(poses.positions)
                self._sensors.show(self._picture)
                self._aim()

    def _aim(self) -> None:
        """Has new models that move fill a third of the page, where nobody has moved the camera."""
        links, models = self._picture.links, self._picture.models.values()
        moving = [each for each in models if not each.static]
        numbers = {each.number for each in moving}
        if not moving or self._aimed & numbers or not all(each.name in links for each in moving):
            return
        self._aimed = numbers
        points = np.concatenate([each.corners(links[each.name]) for each in moving])
        points = points[np.isfinite(points).all(axis=1)]
        camera = overview(points, ASPECT, CAMERA, THIRD)
        start = self._server.initial_camera
        before = np.array(start.position)
        start.position, start.look_at = camera.eye, camera.target
        for client in self._server.get_clients().values():
            ways = np.abs(client.camera.position - np.array([before, UNKNOWN])).max(axis=1)
            if ways.min() < UNTOUCHED:
                with contextlib.suppress(ValueError):  # the page's camera looks nowhere
                    client.camera.position, client.camera.look_at = camera.eye, camera.target

    def _update(self, show: Callable[[], None], period: float) -> None:
        now = time.monotonic()
        if now >= self._due[show]:
            self._due[show] = now + period
            show()

    def _show_texts(self) -> None:
        if not self._scene.is_live:
            self._time.show_missing(self._scene.node)
        elif self._newest is not None:
            newest = self._newest
            now, factor = newest.now.to_sec(), self._scene.real_time_factor
            self._time.show(now, factor, newest.paused, newest.lockstep)
            self._models.show(self._picture.links, self._picture.joints(self._newest.positions))

    def _show_rest(self) -> None:
        if self._scene.is_live:
            self._time.show_speed()
        self._controllers.look()
        self._drive.look()
        self._tree.content = self._controllers.as_html()

    def _screenshot(self, event: viser.GuiEvent[Any]) -> None:
        """Sends what this page shows, at its size, to its browser as a file."""
        client = event.client
        if client is None:
            return
        camera = client.camera
        try:
            picture = client.get_render(
                camera.image_height, camera.image_width, transport_format="png", timeout=RENDERING
            )
        except (TimeoutError, RuntimeError) as fault:  # the page has gone, or hangs
            rospy.logwarn("The window: no screenshot: %s", fault)
            return
        seen, content = Image.fromarray(picture), io.BytesIO()
        paper = Image.new("RGBA", seen.size, "white")  # the background is transparent
        Image.alpha_composite(paper, seen).convert("RGB").save(content, "PNG")
        client.send_file_download("gzclient.png", content.getvalue(), save_immediately=True)


def show(host: str, port: int | None, browser: bool) -> None:
    """Serves the page until the node is shut down; with `browser` opens it where there is a display.

    Raises PortInUse if nothing can be served there.
    """
    page = ServedPage(TITLE, tuple(CAMERA.eye.tolist()), CAMERA.target, host, port)
    with closing(page):
        window = Window(page.server)
        say = partial(print, "gzclient:", flush=True)
        warn = partial(rospy.logwarn, "gazebo_gui: %s")
        advice = page.announce("the window", "moves the simulation", say, warn, browser)
        if not page.address.token:  # which is for no one else; other programs may show the lines
            rospy.set_param(ADVICE, advice)
        try:
            window.run()
        finally:
            with contextlib.suppress(KeyError, OSError, rospy.ROSException):  # the master has gone
                rospy.delete_param(ADVICE)
