"""The window: what is heard of the simulator onto the page, and what is clicked there to the simulator."""

import io
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import rosgraph
import rospy
import viser
from bullet_gazebo_msgs.msg import SceneContacts, ScenePoses
from PIL import Image

from bullet_gazebo.pictures.page.batches import NUMBERS
from bullet_gazebo.pictures.page.picture import Picture
from bullet_gazebo.ros.clients.window.commands import Commands
from bullet_gazebo.ros.clients.window.controllers import Controllers
from bullet_gazebo.ros.clients.window.model_panel import ModelPanel
from bullet_gazebo.ros.clients.window.remote_scene import RemoteScene
from bullet_gazebo.ros.clients.window.time_panel import TimePanel
from bullet_gazebo.ros.clients.window.training import Training
from bullet_gazebo.ros.clients.world_client import ControlFailed
from bullet_gazebo.ros.scene.scene_messages import from_light, from_model
from ros_calls.service import ServiceFailed

WAIT = 0.5  # [s] for a message, before the rest is looked after
OFTEN, SELDOM = 0.25, 2.0  # [s] between two looks at what is shown as text
NOTICE = 8.0  # [s] that a fault is shown
RENDERING = 30.0  # [s] for a browser to draw a screenshot
WORLD = "/world"  # node
NOTHING = SceneContacts()


class Window:
    """Draws in the thread that calls `run`; clicks come in threads of viser's."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._scene = RemoteScene()
        world = server.scene.add_frame(WORLD, show_axes=False)
        self._picture = Picture(server, rospy.logwarn, below=WORLD)
        self._version: int | None = None  # that is drawn
        self._redraw = threading.Event()  # all of it, otherwise than before
        self._newest: ScenePoses | None = None
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
        Training(self._server, tabs).start()
        for box in (self._collisions, self._joint_frames):
            box.on_update(lambda _: self._redraw.set())
        self._due = {self._show_texts: 0.0, self._show_rest: 0.0}  # [s of wall time]

    def attempt(self, act: Callable[[], None]) -> None:
        """Does what was clicked; a fault is shown on the page and in the log."""
        try:
            act()
        except (ServiceFailed, ControlFailed, rospy.ROSException) as fault:
            rospy.logwarn("The window: %s", fault)
            for client in self._server.get_clients().values():
                client.add_notification(
                    "It wasn't done", str(fault), auto_close_seconds=NOTICE, color="red"
                )

    def run(self) -> None:
        """Shows the world until the node is shut down."""
        while not rospy.is_shutdown():
            watched = bool(self._server.get_clients())
            self._scene.look(watched, watched and self._contacts.value)
            poses, contacts = self._scene.wait(WAIT)
            if not watched:
                continue
            try:
                if poses is not None:
                    self._show(poses)
                self._touch(contacts if self._contacts.value else NOTHING)
                self._look_after(self._show_texts, OFTEN)
                self._look_after(self._show_rest, SELDOM)
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
            self._version = scene.version
        if poses.version == self._version:
            self._newest = poses
            with self._server.atomic():
                self._picture.move(np.array(poses.poses, dtype=float).reshape(-1, NUMBERS))
                self._models.follow(self._picture.links)

    def _touch(self, message: SceneContacts | None) -> None:
        """Shows contact points; None leaves what is shown."""
        if message is not None:
            self._picture.touch(np.array(message.points).reshape(-1, 3))

    def _look_after(self, show: Callable[[], None], period: float) -> None:
        now = time.monotonic()
        if now >= self._due[show]:
            self._due[show] = now + period
            show()

    def _show_texts(self) -> None:
        if not self._scene.is_heard:
            self._time.show_missing(self._scene.node)
        elif self._newest is not None:
            newest = self._newest
            now, factor = newest.now.to_sec(), self._scene.real_time_factor
            self._time.show(now, factor, newest.paused, newest.lockstep)
            self._models.show(self._picture.links, self._picture.joints(self._newest.positions))

    def _show_rest(self) -> None:
        if self._scene.is_heard:
            self._time.show_speed()
        self._controllers.look()
        tree = self._controllers.as_html()
        if tree != self._tree.content:
            self._tree.content = tree

    def _screenshot(self, event: viser.GuiEvent[Any]) -> None:
        """What this page shows, at its size, as a file for its browser."""
        client = event.client
        if client is None:
            return
        camera = client.camera
        picture = client.get_render(
            camera.image_height, camera.image_width, transport_format="png", timeout=RENDERING
        )
        seen, content = Image.fromarray(picture), io.BytesIO()
        paper = Image.new("RGBA", seen.size, "white")  # where nothing is, it is clear
        Image.alpha_composite(paper, seen).convert("RGB").save(content, "PNG")
        client.send_file_download("gzclient.png", content.getvalue(), save_immediately=True)
