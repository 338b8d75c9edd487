"""The page's list of sensors' topics; those switched on are subscribed to and drawn."""

import html
import io
import math
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import roslib.message
import rospy
import viser
from bullet_gazebo_msgs.msg import SceneSensor
from PIL import Image
from sensor_msgs.msg import CompressedImage, LaserScan, PointCloud, PointCloud2, Range
from sensor_msgs.msg import Image as ImageMessage

from bullet_gazebo.common.messages import from_pose_msg
from robot_sim.physics.files.elements import shown
from robot_sim.pictures.page import Picture
from robot_sim.pictures.page_batches import compose

PERIOD = 0.1  # [s of wall time] between two drawings of a topic
MOST_POINTS, MOST_COLUMNS, MOST_CHARACTERS = 20_000, 320, 1000  # of what a page is sent
BUFFER = 2**24  # [bytes] that a large message is received in
CONE = 16  # readings that a range is drawn as
RED, BLUE = (220, 30, 30), (40, 90, 220)
POINT, LENGTH, EDGE = 0.02, 0.15, 0.006  # [m]; of points, of frustums and of their edges
OPACITY = 0.2
NOTHING = "<div style='padding: 0 0.8em'>no sensor has a topic</div>"
FAULTS = (
    ArithmeticError, LookupError, OSError, TypeError, ValueError, Image.DecompressionBombError,
)  # fmt: skip
"""What a message may raise that somebody else made."""


class Drawing(NamedTuple):
    """What a message shows, in its own axes. `faces` is what rays have passed."""

    points: np.ndarray  # (n, 3) [m]
    colours: np.ndarray | None = None  # (n, 3) of uint8, if the points have any
    faces: np.ndarray | None = None  # (m, 3) indices of 0, the origin, and of points counted from 1
    picture: np.ndarray | None = None  # (height, width, 3) of uint8
    text: str = ""  # of a message that has no place in the scene


def draw_scan(message: LaserScan) -> Drawing:
    """Draws the points that a row of rays meets, and the area before them."""
    step = message.angle_increment
    span = (message.angle_max - message.angle_min) / step if step else 0.0
    ranges = np.array(message.ranges, float)[: round(span) + 1]
    met = np.isfinite(ranges)
    angles = message.angle_min + step * np.flatnonzero(met)
    points = ranges[met, None] * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    order = np.cumsum(met)  # of the points, from 1
    pairs = np.flatnonzero(met[:-1] & met[1:])
    faces = np.column_stack([np.zeros(len(pairs), int), order[pairs], order[pairs + 1]])
    return Drawing(points, faces=faces)


def draw_range(message: Range) -> Drawing:
    """Draws a range as a scan of equal ranges."""
    half = message.field_of_view / 2.0
    ranges = [message.range] * CONE
    scan = LaserScan(angle_min=-half, angle_max=half, angle_increment=2.0 * half / (CONE - 1), ranges=ranges)
    return draw_scan(scan)


def draw_points(message: PointCloud) -> Drawing:
    """Draws the finite points of a cloud."""
    points = np.array([(each.x, each.y, each.z) for each in message.points]).reshape(-1, 3)
    return _thinned(points, None)


def draw_cloud(message: PointCloud2) -> Drawing:
    """Draws the finite points of a cloud, in their colours."""
    places = {field.name: field.offset for field in message.fields}
    names = [name for name in ("x", "y", "z", "rgb") if name in places]
    layout = np.dtype(
        {
            "names": names, "formats": ["<f4", "<f4", "<f4", "<u4"][: len(names)],
            "offsets": [places[name] for name in names], "itemsize": message.point_step,
        }
    )  # fmt: skip
    columns = np.frombuffer(message.data, layout)
    points = np.stack([columns[name] for name in "xyz"], axis=1)
    if "rgb" not in names:
        return _thinned(points, None)
    shifts = np.array([16, 8, 0], np.uint32)
    return _thinned(points, (columns["rgb"][:, None] >> shifts & 255).astype(np.uint8))


def draw_jpeg(message: CompressedImage) -> Drawing:
    """Draws a camera's picture."""
    picture = Image.open(io.BytesIO(message.data))
    picture.thumbnail((MOST_COLUMNS, MOST_COLUMNS))
    return Drawing(np.zeros((0, 3)), picture=np.asarray(picture.convert("RGB")))


def draw_depths(message: ImageMessage) -> Drawing:
    """Draws depths in grey: the nearest is white, nothing is black."""
    kind = {"32FC1": "<f4", "16UC1": "<u2"}[message.encoding]
    depths = np.frombuffer(message.data, kind).reshape(message.height, message.width)
    every = math.ceil(message.width / MOST_COLUMNS)
    depths = np.where(depths > 0, depths, math.inf)[::every, ::every].astype(float)
    met = np.isfinite(depths)
    low, high = (depths[met].min(), depths[met].max()) if met.any() else (0.0, 1.0)
    shares = (np.where(met, depths, high) - low) / max(high - low, 1e-9)
    grey = np.where(met, 255.0 - 200.0 * shares, 0.0).astype(np.uint8)
    return Drawing(np.zeros((0, 3)), picture=np.repeat(grey[..., None], 3, axis=2))


def draw_text(message: Any) -> Drawing:
    """Draws any message as its text."""
    return Drawing(np.zeros((0, 3)), text=str(message)[:MOST_CHARACTERS])


def _thinned(points: np.ndarray, colours: np.ndarray | None) -> Drawing:
    met = np.flatnonzero(np.isfinite(points).all(axis=1))
    kept = met[:: max(1, math.ceil(len(met) / MOST_POINTS))]
    return Drawing(points[kept], None if colours is None else colours[kept])


DRAWN: dict[str, tuple[type, Callable[[Any], Drawing]]] = {
    kind._type: (kind, draw)
    for kind, draw in (
        (LaserScan, draw_scan), (Range, draw_range), (PointCloud, draw_points),
        (PointCloud2, draw_cloud), (CompressedImage, draw_jpeg), (ImageMessage, draw_depths),
    )
}  # fmt: skip


def drawn_as(kind: str) -> tuple[type, Callable[[Any], Drawing]] | None:
    """Returns a message's type by its name, and what draws it; None if the type isn't known here."""
    other = None if kind in DRAWN else roslib.message.get_message_class(kind)
    return DRAWN.get(kind, other and (other, draw_text))


class SensorPanel:
    """A checkbox for each topic, in the open tab. For one thread; viser and rospy only leave messages."""

    def __init__(self, server: viser.ViserServer, below: str) -> None:
        self._server, self._below = server, below
        self._views: list[SensorView] = []
        self._nothing = server.gui.add_html(NOTHING)
        self._folder = server.gui.add_folder("Topics", visible=False)
        self._made = 0

    def set_sensors(self, sensors: Sequence[SceneSensor]) -> None:
        """Lists these topics; those that stay keep their drawings."""
        kept = {each.sensor.topic: each for each in self._views if each.sensor in sensors}
        for view in self._views:
            if view not in kept.values():
                view.remove()
        self._views = []
        for sensor in sensors:
            if sensor.topic not in [each.sensor.topic for each in self._views]:
                added = kept.get(sensor.topic) or self._add(sensor)
                if added is not None:
                    self._views.append(added)
        self._nothing.visible = not self._views
        self._folder.visible = bool(self._views)

    def _add(self, sensor: SceneSensor) -> "SensorView | None":
        """Returns the view of a topic; None if its type isn't known here."""
        drawn = drawn_as(sensor.kind)
        if drawn is None:
            return None
        self._made += 1  # a removed node's name would come back
        name = f"{self._below}/sensor{self._made}"
        return SensorView(self._server, self._folder, sensor, name, *drawn)

    def listen(self, watched: bool) -> None:
        """Subscribes to the topics switched on, while a page is open."""
        for view in self._views:
            view.listen(watched)

    def show(self, scene: Picture) -> None:
        """Draws new messages at the links of the scene."""
        if not any(view.is_on for view in self._views):
            return
        links = scene.links
        models = {each.name: each for each in scene.models.values() if each.name in links}
        for view in self._views:
            model = models.get(view.sensor.model)
            names = [link.name for link in model.links] if model is not None else []
            if view.sensor.link in names:
                view.show(links[view.sensor.model][names.index(view.sensor.link)])


class SensorView:
    """A topic: its checkbox, its subscriber while it is switched on, its nodes on the page."""

    def __init__(
        self, server: viser.ViserServer, folder: viser.GuiFolderHandle, sensor: SceneSensor, name: str,
        kind: type, draw: Callable[[Any], Drawing],
    ) -> None:  # fmt: skip
        """`folder` gets its checkbox and picture, `name` is that of its nodes; `draw` draws a `kind`."""
        self.sensor = sensor
        self._server, self._folder, self._name = server, folder, name
        pose = from_pose_msg(sensor.pose)
        self._inner = np.array([(*pose.position, *pose.orientation)])
        self._kind, self._draw = kind, draw
        with folder:
            label = shown(sensor.topic.removesuffix("/compressed"))
            self._box = server.gui.add_checkbox(label, False)
        self._picture: viser.GuiImageHandle | None = None
        self._text: viser.GuiHtmlHandle | None = None
        self._frame: viser.FrameHandle | None = None
        self._frustum: viser.CameraFrustumHandle | None = None
        self._subscriber: rospy.Subscriber | None = None
        self._newest: Any = None
        self._due = 0.0  # [s of wall time]

    @property
    def is_on(self) -> bool:
        """Whether it is subscribed to."""
        return self._subscriber is not None

    def listen(self, watched: bool) -> None:
        """Subscribes if a page is open and it is switched on, else removes its drawing."""
        wanted = watched and self._box.value
        if wanted and self._subscriber is None:
            self._subscriber = rospy.Subscriber(
                self.sensor.topic, self._kind, self._receive, queue_size=1, buff_size=BUFFER,
                tcp_nodelay=True,
            )  # fmt: skip
        elif not wanted and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = self._newest = None
        if not self._box.value:
            self._clear()

    def _receive(self, message: Any) -> None:
        self._newest = message

    def show(self, link: np.ndarray) -> None:
        """Draws the newest message where its link (7,) is now, and moves the frustum with the link."""
        if not self.is_on:
            return
        place = compose(link[None], self._inner)[0]
        if self._frustum is not None:
            self._frustum.position, self._frustum.wxyz = place[:3], place[[6, 3, 4, 5]]
        message, now = self._newest, time.monotonic()
        if message is None or now < self._due:
            return
        self._newest, self._due = None, now + PERIOD
        try:
            drawing = self._draw(message)
        except FAULTS as fault:
            rospy.logwarn_once(f"{self.sensor.topic} can't be drawn: {fault}")
            return
        if drawing.text:
            self._show_text(drawing.text)
        elif drawing.picture is not None:
            self._show_picture(drawing.picture, place)
        else:
            self._show_points(drawing, place)

    def _show_points(self, drawing: Drawing, place: np.ndarray) -> None:
        """Replaces the points: they stay where they were measured when the link moves on."""
        scene, name = self._server.scene, self._name
        if not len(drawing.points):
            self._clear()
            return
        with self._server.atomic():
            self._frame = scene.add_frame(name, show_axes=False, position=place[:3], wxyz=place[[6, 3, 4, 5]])
            colours = RED if drawing.colours is None else drawing.colours
            points = drawing.points.astype(np.float32)
            scene.add_point_cloud(
                f"{name}/points", points, colours, point_size=POINT, point_shape="circle",
                precision="float32", point_shading="flat",
            )  # fmt: skip
            if drawing.faces is not None and len(drawing.faces):
                corners = np.concatenate([np.zeros((1, 3), np.float32), points])
                scene.add_mesh_simple(
                    f"{name}/area", corners, drawing.faces.astype(np.uint32), color=BLUE,
                    opacity=OPACITY, side="double", cast_shadow=False, receive_shadow=False,
                )  # fmt: skip

    def _show_text(self, text: str) -> None:
        content = f"<pre style='padding: 0 0.8em'>{html.escape(text)}</pre>"
        if self._text is None:
            with self._folder:
                self._text = self._server.gui.add_html(content, order=self._box.order + 0.5)
        else:
            self._text.content = content

    def _show_picture(self, picture: np.ndarray, place: np.ndarray) -> None:
        if self._picture is None or self._frustum is None:
            with self._folder:
                order = self._box.order + 0.5
                self._picture = self._server.gui.add_image(picture, format="jpeg", order=order)
            across, aspect = self.sensor.field_of_view, self.sensor.aspect
            self._frustum = self._server.scene.add_camera_frustum(
                self._name, 2.0 * math.atan(math.tan(across / 2.0) / aspect), aspect, scale=LENGTH,
                thickness=EDGE, color=BLUE, position=place[:3], wxyz=place[[6, 3, 4, 5]],
                cast_shadow=False,
            )  # fmt: skip
        else:
            self._picture.image = picture

    def _clear(self) -> None:
        for node in (self._frame, self._frustum, self._picture, self._text):
            if node is not None:
                node.remove()
        self._frame = self._frustum = self._picture = self._text = None

    def remove(self) -> None:
        """Ends it."""
        self._box.value = False  # type: ignore[misc]
        self.listen(False)
        self._box.remove()
