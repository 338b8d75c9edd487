"""Topics of cameras: pictures, JPEGs, camera_info (docs/contract/sensors.md 4a)."""

import io
from contextlib import suppress
from typing import Any

import numpy as np
import rospy
from dynamic_reconfigure.encoding import Config
from PIL import Image as Pillow
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from sensor_msgs.srv import SetCameraInfo, SetCameraInfoResponse
from std_msgs.msg import Header

from bullet_gazebo.common.dynamic_server import FIRST, DynamicServer, Parameter
from bullet_gazebo.common.messages import to_time
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import (
    MODEL,
    SensorTopics,
    frame_of,
    namespace_of,
    offer_shared,
    topic_in,
)
from robot_sim.physics.pose import Pose
from robot_sim.sensors.camera_sensors import shot_of
from robot_sim.sensors.pinhole import CameraView, PinholeCamera, Shot
from robot_sim.sensors.rendering import PictureStream
from robot_sim.state_dict import Shared

QUEUE = 2
IMAGER_RATE = Parameter("imager_rate", "double", 2.0, 1.0, 50.0)  # [Hz]
MONO = {"L8": np.uint8, "L_INT8": np.uint8, "L16": np.uint16, "L_INT16": np.uint16}
COLOUR = {
    "R8G8B8": "rgb8", "RGB_INT8": "rgb8", "B8G8R8": "bgr8", "BGR_INT8": "bgr8", "R16G16B16": "rgb16",
    "RGB_INT16": "rgb16",
}  # fmt: skip
BAYER = {  # the channel of each pixel of a two-by-two tile
    "BAYER_RGGB8": (0, 1, 1, 2), "BAYER_BGGR8": (2, 1, 1, 0), "BAYER_GBRG8": (1, 2, 0, 1),
    "BAYER_GRBG8": (1, 0, 2, 1),
}  # fmt: skip
READABLE = {  # by encoding: how many channels, and where red, green and blue are
    "rgb8": (3, (0, 1, 2)), "bgr8": (3, (2, 1, 0)), "rgba8": (4, (0, 1, 2)), "bgra8": (4, (2, 1, 0)),
    "mono8": (1, (0, 0, 0)),
}  # fmt: skip
LUMINANCE = (0.299, 0.587, 0.114)
OPTICAL = Pose(orientation=(-0.5, 0.5, -0.5, 0.5))  # x right, y down, z ahead


class CameraTopics(Shared):
    """Image, JPEG and camera_info of one camera, all below `scope`.

    Args:
        names: Of the image and of its camera_info.
        baseline: [m] to the camera on the left.
        own: Prefix of its service, if the plugin has several cameras.
        frame: `<frameName>` if None.
        latch: Whether a new subscriber gets the last picture.
    """

    def __init__(
        self, context: PluginContext, camera: PinholeCamera, topics: SensorTopics, scope: str,
        names: tuple[str, str], baseline: float, own: str = "", frame: str | None = None,
        latch: bool = False,
    ) -> None:  # fmt: skip
        self._context, self._camera = context, camera
        given = context.text("frameName", "") if frame is None else frame
        self._frame = frame_of(scope, given)
        self.info = camera_info(context, camera, baseline)
        image = topic_in(scope, names[0])
        colours = 3 * camera.width * camera.height
        self._image = topics.advertise(image, Image, QUEUE, latch, content=colours)
        self._jpeg = topics.advertise(f"{image}/compressed", CompressedImage, QUEUE)
        show_camera(context, f"{image}/compressed", CompressedImage, camera)
        self._info = topics.advertise(topic_in(scope, names[1]), CameraInfo, QUEUE)
        self._own = own
        service = topic_in(scope, f"{own}set_camera_info")
        offer_shared(context, service, SetCameraInfo, self._set)

    @property
    def wants_colour(self) -> bool:
        """Whether somebody looks at its pictures."""
        return self._image.has_subscribers or self._jpeg.has_subscribers

    def header(self, now: int) -> Header:
        return Header(stamp=to_time(now), frame_id=self._frame)

    def shot(self, now: int, colours: bool = False, depths: bool = False) -> Shot:
        """Returns what its picture at a time [ns] is made of; the plugin may need `colours` and `depths`."""
        return shot_of(
            self._context, self._camera, now, self._own,
            image=self.wants_colour, colours=colours, depths=depths,
        )  # fmt: skip

    def send(self, picture: CameraView, now: int) -> None:
        """Publishes the subscribed parts of a picture at a time [ns]."""
        header, seen = self.header(now), picture.image
        if seen.size and self._image.has_subscribers:
            self._image.publish(to_image(seen, self._camera.format, header))
        if seen.size and self._jpeg.has_subscribers:
            self._jpeg.publish(_to_jpeg(seen, header))
        if self._info.has_subscribers:
            self.info.header = header
            self._info.publish(self.info)

    def _set(self, request: object) -> SetCameraInfoResponse:
        """Takes over a calibration."""
        given = request.camera_info  # type: ignore[attr-defined]
        if (given.width, given.height) != (self._camera.width, self._camera.height):
            return SetCameraInfoResponse(False, "the size isn't that of the camera's pictures")
        self.info = given
        return SetCameraInfoResponse(True, "")


def stream_of(context: PluginContext) -> PictureStream:
    """Returns the way of a plugin's pictures to topics that are advertised: it closes before them."""
    sensing, name = context.sensing, f"{context.model.name}, {context.key}"
    stream = PictureStream(name, sensing.renderer, sensing.schedule)
    context.closing(stream.close)
    return stream


def show_camera(context: PluginContext, topic: str, kind: type, camera: PinholeCamera) -> None:
    """Has windows offer a topic in the optical axes of a camera."""
    view = camera.field_of_view, camera.width / camera.height
    context.show(topic, kind, camera.link, camera.pose.compose(OPTICAL), view)


def scope_of(context: PluginContext) -> str:
    """Returns the full name that a camera's topics are in: its namespace and `<cameraName>`."""
    namespace, name = namespace_of(context, absent="", empty=MODEL), context.text("cameraName", "")
    return topic_in(namespace, name) if name else namespace


def offer_rate(context: PluginContext, topics: SensorTopics, scope: str) -> None:
    """Offers dynamic_reconfigure of a camera with a `<cameraName>`: `imager_rate` counts once it is set."""

    def apply(wanted: Config, level: int) -> Config:
        if level != FIRST:
            with context.sim.lock:
                topics.set_rate(wanted["imager_rate"])
        return wanted

    if context.text("cameraName", ""):
        with suppress(rospy.ServiceException):  # another camera below the same name offers it
            context.closing(DynamicServer([IMAGER_RATE], apply, scope).shutdown)


def to_image(seen: np.ndarray, pixel_format: str, header: Header) -> Image:
    """Returns the message of a picture (height, width, 3) of uint8 in one of SDF's pixel formats."""
    height, width = seen.shape[:2]
    encoding = COLOUR.get(pixel_format, "bgr8")
    data = seen[..., ::-1] if encoding == "bgr8" else seen
    if pixel_format in MONO:
        kind = MONO[pixel_format]
        encoding = "mono8" if kind is np.uint8 else "mono16"
        grey = np.rint(seen @ LUMINANCE)
        data = (grey if kind is np.uint8 else grey * 257.0).astype(kind)
    elif encoding == "rgb16":
        data = seen.astype(np.uint16) * 257
    elif pixel_format in BAYER:
        encoding = pixel_format.lower()
        rows, columns = np.indices((height, width)) % 2
        channels = np.array(BAYER[pixel_format])[2 * rows + columns]
        data = np.take_along_axis(seen, channels[..., None], axis=2)[..., 0]
    content = np.ascontiguousarray(data)
    return Image(header, height, width, encoding, 0, content.nbytes // height, content.tobytes())


def read_image(message: Image) -> dict[str, np.ndarray]:
    """Returns a message's picture; an encoding that isn't `READABLE` is a ValueError."""
    if message.encoding not in READABLE:
        raise ValueError(f"pictures are {message.encoding}; {', '.join(READABLE)} can be read")
    count, order = READABLE[message.encoding]
    pixels = _rows(message, np.dtype(np.uint8), count)
    return {"image": np.ascontiguousarray(pixels[..., order])}


def read_depth(message: Image) -> dict[str, np.ndarray]:
    """Returns a message's depths [m]; another encoding than 32FC1 and 16UC1 is a ValueError."""
    if message.encoding == "32FC1":
        return {"depth": _rows(message, np.dtype("<f4"), 1)[..., 0]}
    if message.encoding != "16UC1":
        raise ValueError(f"depths are {message.encoding}; 32FC1 and 16UC1 can be read")
    depth = _rows(message, np.dtype("<u2"), 1)[..., 0] / np.float32(1000.0)
    return {"depth": np.where(depth > 0.0, depth, np.float32(np.nan))}


def _rows(message: Image, kind: np.dtype[Any], channels: int) -> np.ndarray:
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)
    used = np.ascontiguousarray(rows[:, : message.width * channels * kind.itemsize])
    return used.view(kind).reshape(message.height, message.width, channels)


def _to_jpeg(seen: np.ndarray, header: Header) -> CompressedImage:
    memory = io.BytesIO()
    Pillow.fromarray(seen).save(memory, "JPEG", quality=80)
    return CompressedImage(header, "rgb8; jpeg compressed bgr8", memory.getvalue())


def camera_info(context: PluginContext, camera: PinholeCamera, baseline: float = 0.0) -> CameraInfo:
    """Returns the calibration of a camera whose baseline is in metres, from the plugin's elements."""
    f = context.number("focalLength", 0.0) or camera.focal_length
    cx = context.number("Cx", 0.0) or (camera.width + 1.0) / 2.0
    cy = context.number("Cy", 0.0) or (camera.height + 1.0) / 2.0
    k1, k2, k3, t1, t2 = (context.number(f"distortion{name}", 0.0) for name in ("K1", "K2", "K3", "T1", "T2"))
    return CameraInfo(
        height=camera.height,
        width=camera.width,
        distortion_model="plumb_bob",
        D=[k1, k2, t1, t2, k3],
        K=[f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0],
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=[f, 0.0, cx, -f * baseline, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )
