"""Sensors' plugins without a master: bad ones are told in a line, and all go with their model."""

import gc
import math
import threading
import tracemalloc
from collections import Counter

import pytest
import rospy
from dynamic_reconfigure.encoding import encode_config
from dynamic_reconfigure.srv import ReconfigureRequest
from geometry_msgs.msg import Vector3
from hector_gazebo_plugins.srv import SetBiasRequest
from hypothesis import HealthCheck, Phase, given, settings
from sensor_msgs.msg import CameraInfo, Image, Imu, LaserScan
from support.mutations.xml_trees import mutated_xml
from support.ros.silent_topics import SilentPublisher, SilentService, SilentSubscriber, silence

from bullet_gazebo.plugins.camera_plugin import MOST_WAITING
from bullet_gazebo.plugins.plugin_loader import PluginRegistry
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from robot_sim.sensors.picture_process import PictureProcess
from robot_sim.sensors.pinhole import PinholeCamera
from robot_sim.simulator import Simulator

MODEL = """<sdf version="1.6"><model name="m"><link name="l"><inertial><mass>1</mass></inertial>
<sensor name="good" type="imu"><plugin name="g" filename="libgazebo_ros_imu_sensor.so">
<frameName>f</frameName></plugin></sensor>{}</link>{}</model></sdf>"""
SENSOR = '<sensor name="bad" type="{}">{}<plugin name="p" filename="libgazebo_ros_{}.so">{}</plugin></sensor>'
SCAN = (
    "<ray><scan><horizontal><samples>{}</samples></horizontal></scan>"
    "<range><min>{}</min><max>{}</max></range>{}</ray>"
)
NOISE = "<noise><type>gaussian</type><stddev>{}</stddev></noise>"
ROUNDED = "<noise><type>gaussian_quantized</type><precision>1e-300</precision></noise>"
OWN_NOISE = "<bodyName>l</bodyName><gaussianNoise>-1</gaussianNoise>"
SIZE = "<image><width>{}</width><height>{}</height></image>"
TOPIC = "<bodyName>l</bodyName><topicName>{}</topicName>"
SLOW = "<bodyName>l</bodyName><topicName>t</topicName><updateRate>-1</updateRate>"
CAMERA = "<camera>{}</camera>"


def laser(samples="4", low="0.1", high="5", more="", kind="ray", before=""):
    scan = before + SCAN.format(samples, low, high, more)
    return SENSOR.format(kind, scan, "gpu_laser" if kind == "gpu_ray" else "laser", "")


def camera(inside="", own=""):
    return SENSOR.format("camera", CAMERA.format(inside), "camera", own)


def of_model(library, inside):
    return f'<plugin name="p" filename="lib{library}.so">{inside}</plugin>'


def hector(tag, number):
    return of_model("hector_gazebo_ros_gps", f"<bodyName>l</bodyName><{tag}>{number}</{tag}>")


BAD = {  # what is wrong: a link's part, a model's part, and words of the line
    "no rays": (laser("0"), "", "sensor 'bad', <horizontal>: 0 samples"),
    "ten million rays": (laser("10000000"), "", "sensor 'bad', <horizontal>: 1e+07 samples"),
    "half a ray": (laser("1.5"), "", "1.5 samples"),
    "range of NaN": (laser(low="nan"), "", "<range/min>"),
    "endless range": (laser(high="inf"), "", "<range/max>"),
    "range beyond a message": (laser(high="1e39"), "", "<range> is 0.1 to 1e+39 m"),
    "range backwards": (laser(low="5", high="1"), "", "<range> is 5 to 1 m"),
    "absurd noise": (laser(more=NOISE.format("1e400")), "", "<stddev>"),
    "more noise than there is": (laser(more=NOISE.format("1e308")), "", "<stddev> is 1e+308"),
    "negative noise": (laser(more=NOISE.format(-1)), "", "<stddev> is -1"),
    "negative rate": (laser(before="<update_rate>-1</update_rate>"), "", "<update_rate> is -1"),
    "truth's negative rate": ("", of_model("gazebo_ros_p3d", SLOW), "<updateRate> is -1"),
    "camera's negative rate": (camera(own="<updateRate>-1</updateRate>"), "", "<updateRate> is -1"),
    "a huge picture": (camera(SIZE.format(2000, 2000)), "", "2100000 pixels"),
    "a picture that is no JPEG": (camera(SIZE.format(70000, 1)), "", "<image/width> is 70000"),
    "an endless picture": (camera("<clip><far>1e300</far></clip>"), "", "<clip> is 0.1 to 1e+300 m"),
    "no picture": (camera("<image><width>0</width></image>"), "", "<image/width> is 0"),
    "half a circle": (camera("<horizontal_fov>4</horizontal_fov>"), "", "<horizontal_fov> is 4 rad"),
    "wrong sensor": (laser(kind="camera"), "", "the camera sensor 'bad', not to a sensor of type ray"),
    "a sensor's plugin of a model": ("", of_model("gazebo_ros_laser", ""), "it belongs to a model"),
    "unknown link": ("", of_model("gazebo_ros_p3d", "<bodyName>x</bodyName>"), "no link 'x'"),
    "unknown joint": ("", of_model("gazebo_ros_ft_sensor", "<jointName>x</jointName>"), "no joint 'x'"),
    "negative deviation": ("", of_model("gazebo_ros_imu", OWN_NOISE), "<gaussianNoise> is -1"),
    "a topic with a blank": ("", of_model("gazebo_ros_p3d", TOPIC.format("a b")), "'/a b' is no name"),
    "a topic without a name": ("", of_model("gazebo_ros_p3d", TOPIC.format("/")), "'/' is no name"),
    "a number beyond a message": (camera(own="<Cx>1e308</Cx>"), "", "<Cx> is 1e+308"),
    "a drift beyond reason": ("", hector("drift", "1e308"), "<drift>"),
    "a negative frequency": ("", hector("driftFrequency", -1), "<driftFrequency> is -1"),
    "rounding to nothing": (laser(more=ROUNDED), "", "<precision> is 1e-300"),
    "unknown plugin": ("", of_model("nothing_at_all", ""), "plugin libnothing_at_all.so"),
    "no cameras": ("", of_model("realsense_gazebo_plugin", "<prefix>d435</prefix>"), "no sensor 'd435depth'"),
}  # fmt: skip

OURS = (
    "Sensor", "Plugin", "Model", "Target", "Camera", "Laser", "Hector", "Silent", "Bullet", "Link",
)  # fmt: skip


class Node:
    """A world with the plugins of a node."""

    def __init__(self, lines):
        self.lines = lines
        self.sim = Simulator(World(make_engine()), lockstep=True)
        self.sim.world.spawn("ground_plane", ground_plane(), Pose())
        self.plugins = PluginRegistry(self.sim, None)

    def spawn(self, text):
        """Spawns, steps and deletes a model; returns the lines that were logged of it."""
        self.lines.clear()
        SilentPublisher.messages.clear()
        description = parse_sdf(text)
        model = self.sim.world.spawn("m", description, Pose((0.0, 0.0, 1.0)))
        self.plugins.load(model, "/")
        with self.sim.lock:
            self.sim.advance(3)
            self.sim.reset(everything=False)
            self.sim.advance(1)
        self.plugins.unload(model)
        with self.sim.lock:
            self.sim.delete_model(model)
        return [*self.lines, *description.warnings, *description.left_out]


def published(kind):
    topics = SilentPublisher.messages.values()
    return [each for topic in topics for each in topic if isinstance(each, kind)]


@pytest.fixture
def node(monkeypatch):
    node = Node(silence(monkeypatch))
    yield node
    node.sim.world.close()


@pytest.mark.parametrize("fault", BAD)
def test_an_impossible_sensor_is_told_in_a_line(node, fault):
    of_link, of_the_model, words = BAD[fault]
    [line] = node.spawn(MODEL.format(of_link, of_the_model))
    assert words in line and "\n" not in line
    assert node.sim.now == 4_000_000


def test_rates_that_are_nearly_none_measure_only_for_a_listener_that_comes(node):
    assert not node.spawn(MODEL.format(laser(before="<update_rate>1e-320</update_rate>"), ""))
    times = [each.header.stamp.to_nsec() for each in published(LaserScan)]
    assert times == [0, 3_000_000]  # and after a reset


def test_no_noise_may_be_written_with_a_sign(node):
    own = "<bodyName>l</bodyName><topicName>t</topicName><gaussianNoise>-0.0</gaussianNoise>"
    plugin = of_model("gazebo_ros_p3d", own)
    assert not node.spawn(MODEL.format(laser(more=NOISE.format("-0.0")), plugin))
    assert len(published(LaserScan)) > 1


def test_errors_of_an_imu_that_cannot_be_are_refused(node):
    plugin = of_model("hector_gazebo_ros_imu", "<bodyName>l</bodyName><topicName>felt</topicName>")
    model = node.sim.world.spawn("m", parse_sdf(MODEL.format("", plugin)), Pose())
    node.plugins.load(model, "/")
    handlers = SilentService.handlers
    wanted = {"drift_frequency": -1.0, "drift": 0.5, "offset": math.nan}
    answer = handlers["/felt/accel/set_parameters"](ReconfigureRequest(encode_config(wanted)))
    values = {each.name: each.value for each in answer.config.doubles}
    assert (values["drift_frequency"], values["drift"], values["offset"]) == (0.0, 0.5, 0.0)
    with pytest.raises(rospy.ServiceException, match="not finite"):
        handlers["/felt/set_rate_bias"](SetBiasRequest(Vector3(math.nan, 0.0, 0.0)))
    with node.sim.lock:
        node.sim.advance(3)
    felt = published(Imu)
    node.plugins.unload(model)
    assert felt
    for each in felt:
        for vector in (each.linear_acceleration, each.angular_velocity):
            assert all(map(math.isfinite, (vector.x, vector.y, vector.z)))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("sensor", [laser(), laser(kind="gpu_ray"), camera()])
def test_a_sensor_light_years_away_sees_nothing_without_a_word(node, sensor):
    assert not node.spawn(MODEL.format(sensor.replace(">", "><pose>1e300 0 0 0 0 0</pose>", 1), ""))


def test_an_unheard_laser_of_a_million_rays_keeps_no_memory(node, monkeypatch):
    monkeypatch.setattr(SilentPublisher, "has_connections", lambda self: False)
    text = MODEL.format(laser("1000000"), "")
    node.spawn(text)
    tracemalloc.start()
    try:
        node.spawn(text)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 4_000_000


@pytest.mark.parametrize(("heard", "pictures"), [(True, MOST_WAITING), (False, 0)])
def test_a_storm_of_triggers_costs_no_more_than_some_pictures(node, monkeypatch, heard, pictures):
    monkeypatch.setattr(SilentPublisher, "has_connections", lambda self: heard)
    taken, take = [], PinholeCamera.picture
    monkeypatch.setattr(PinholeCamera, "picture", lambda *a: taken.append(a) or take(*a))
    text = MODEL.format(SENSOR.format("camera", CAMERA.format(""), "triggered_camera", ""), "")
    model = node.sim.world.spawn("m", parse_sdf(text), Pose())
    node.plugins.load(model, "/")
    [trigger] = SilentSubscriber.open.values()
    for _ in range(500):
        trigger.callback(None)
    with node.sim.lock:
        node.sim.advance(100)
    node.plugins.unload(model)
    assert len(taken) == pictures


def test_nothing_of_a_model_with_all_sensors_stays_when_it_goes(node, root):
    """But for the last one, whose shapes rays know until the next cast."""
    text = (root / "test/data/sensors/bot.sdf").read_text(encoding="utf-8")
    counts = []
    for _ in range(4):
        node.spawn(text)
        gc.collect()
        assert not SilentPublisher.names and not SilentService.handlers
        counts.append(Counter(type(each).__qualname__ for each in gc.get_objects()))
    grown = counts[-1] - counts[1]
    ours = {each for each in grown if each.startswith(OURS)}
    assert not ours and sum(grown.values()) < 50, grown


def test_two_robots_with_the_same_topics_live_together(node, root):
    text = (root / "test/data/sensors/bot.sdf").read_text(encoding="utf-8")
    other = node.sim.world.spawn("other", parse_sdf(text), Pose((5.0, 0.0, 1.0)))
    node.plugins.load(other, "/")
    [odd] = node.spawn(text)
    assert "'odd'" in odd


@pytest.mark.slow
def test_mutated_sensors_measure_or_are_refused(root):
    """All plugins, all heard: no traceback, whatever the file says."""
    base = (root / "test/data/sensors/bot.sdf").read_text(encoding="utf-8")
    seen: Counter[bool] = Counter()

    with pytest.MonkeyPatch.context() as patch:
        node = Node(silence(patch))

        @settings(max_examples=50, deadline=None, database=None, derandomize=True, phases=[Phase.generate],
                  suppress_health_check=list(HealthCheck))  # fmt: skip
        @given(mutated_xml(base))
        def look(text):
            try:
                lines = node.spawn(text)
            except DescriptionError:
                seen[False] += 1
                return
            assert not [line for line in lines if "\n" in line], lines
            seen[True] += 1

        look()
        node.sim.world.close()
    assert seen[True] > 10


@pytest.mark.parametrize(("scale", "size"), [(1.0, (40, 30)), (0.25, (10, 8)), (0.001, (1, 1))])
def test_pictures_are_made_smaller_where_that_is_asked_for(node, scale, size):
    node.plugins = PluginRegistry(node.sim, None, camera_scale=scale)
    plugin = '<plugin name="p" filename="libgazebo_ros_camera.so"/>'
    camera = (
        '<sensor name="s" type="camera"><update_rate>1000</update_rate><camera><image><width>40</width>'
        f"<height>30</height></image></camera>{plugin}</sensor>"
    )
    assert not node.spawn(MODEL.format(camera, ""))
    [image, *_], [info, *_] = published(Image), published(CameraInfo)
    assert (image.width, image.height) == (info.width, info.height) == size
    assert info.K[0] == pytest.approx(size[0] / (2.0 * math.tan(1.047 / 2.0)))


def test_in_real_time_pictures_of_all_kinds_come_from_beside_the_ticks(node):
    node.sim.lockstep = False
    pictures = PictureProcess(node.sim, "rays")
    node.plugins = PluginRegistry(node.sim, None, renderer=pictures)
    kinect = ("depth", CAMERA.format(""), "openni_kinect", "<cameraName>deep</cameraName>")
    sensors = SENSOR.format(*kinect).replace("bad", "deep")
    sensors += camera(own="<cameraName>eye</cameraName>")
    model = node.sim.world.spawn("m", parse_sdf(MODEL.format(sensors, "")), Pose())
    node.plugins.load(model, "/")
    kinds = {"/eye/image_raw", "/eye/image_raw/compressed", "/deep/depth/image_raw", "/deep/points"}
    for _ in range(30_000):
        node.sim.step(1)
        if kinds <= {topic for topic, sent in SilentPublisher.messages.items() if sent}:
            break
        threading.Event().wait(0.001)
    node.plugins.unload(model)
    sent = {topic: [*messages] for topic, messages in SilentPublisher.messages.items()}
    stamps = [each.header.stamp.to_nsec() for each in sent["/eye/image_raw"]]
    assert stamps == sorted(set(stamps)) and stamps[-1] <= node.sim.now
    assert {topic for topic, messages in sent.items() if messages} >= kinds
    for _ in range(5):
        node.sim.step(1)
    assert {topic: [*each] for topic, each in SilentPublisher.messages.items()} == sent
