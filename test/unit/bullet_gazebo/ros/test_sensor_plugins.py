"""Sensors' plugins without a master: bad ones are told in a line, and all go with their model."""

import gc
from collections import Counter

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from support.mutations.xml_trees import mutated_xml
from support.ros.silent_topics import SilentPublisher, SilentService, silence

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.engines import make_engine
from bullet_gazebo.physics.files.sdf import parse_sdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import World, ground_plane
from bullet_gazebo.ros.plugins.plugin_loader import PluginRegistry
from bullet_gazebo.simulator import Simulator

MODEL = """<sdf version="1.6"><model name="m"><link name="l"><inertial><mass>1</mass></inertial>
<sensor name="good" type="imu"><plugin name="g" filename="libgazebo_ros_imu_sensor.so">
<frameName>f</frameName></plugin></sensor>{}</link>{}</model></sdf>"""
SENSOR = '<sensor name="bad" type="{}">{}<plugin name="p" filename="libgazebo_ros_{}.so">{}</plugin></sensor>'
SCAN = (
    "<ray><scan><horizontal><samples>{}</samples></horizontal></scan>"
    "<range><min>{}</min><max>{}</max></range>{}</ray>"
)
NOISE = "<noise><type>gaussian</type><stddev>{}</stddev></noise>"
OWN_NOISE = "<bodyName>l</bodyName><gaussianNoise>-1</gaussianNoise>"
SIZE = "<image><width>100000</width><height>100000</height></image>"
CAMERA = "<camera>{}</camera>"


def laser(samples="4", low="0.1", high="5", more="", kind="ray", before=""):
    return SENSOR.format(kind, before + SCAN.format(samples, low, high, more), "laser", "")


def camera(inside="", own=""):
    return SENSOR.format("camera", CAMERA.format(inside), "camera", own)


def of_model(library, inside):
    return f'<plugin name="p" filename="lib{library}.so">{inside}</plugin>'


BAD = {  # what is wrong: a link's part, a model's part, and words of the line
    "no rays": (laser("0"), "", "sensor 'bad', <horizontal>: 0 samples"),
    "ten million rays": (laser("10000000"), "", "sensor 'bad', <horizontal>: 1e+07 samples"),
    "half a ray": (laser("1.5"), "", "1.5 samples"),
    "range of NaN": (laser(low="nan"), "", "<range/min>"),
    "endless range": (laser(high="inf"), "", "<range/max>"),
    "range backwards": (laser(low="5", high="1"), "", "<range> is 5 to 1 m"),
    "absurd noise": (laser(more=NOISE.format("1e400")), "", "<stddev>"),
    "more noise than there is": (laser(more=NOISE.format("1e308")), "", "<stddev> is 1e+308"),
    "negative noise": (laser(more=NOISE.format(-1)), "", "<stddev> is -1"),
    "negative rate": (laser(before="<update_rate>-1</update_rate>"), "", "<update_rate> is -1"),
    "camera's negative rate": (camera(own="<updateRate>-1</updateRate>"), "", "<updateRate> is -1"),
    "a huge picture": (camera(SIZE), "", "4000000 pixels"),
    "no picture": (camera("<image><width>0</width></image>"), "", "<image/width> is 0"),
    "half a circle": (camera("<horizontal_fov>4</horizontal_fov>"), "", "<horizontal_fov> is 4 rad"),
    "wrong sensor": (laser(kind="camera"), "", "the camera sensor 'bad', not to a sensor of type ray"),
    "a sensor's plugin of a model": ("", of_model("gazebo_ros_laser", ""), "it belongs to a model"),
    "unknown link": ("", of_model("gazebo_ros_p3d", "<bodyName>x</bodyName>"), "no link 'x'"),
    "unknown joint": ("", of_model("gazebo_ros_ft_sensor", "<jointName>x</jointName>"), "no joint 'x'"),
    "negative deviation": ("", of_model("gazebo_ros_imu", OWN_NOISE), "<gaussianNoise> is -1"),
    "unknown plugin": ("", of_model("nothing_at_all", ""), "plugin libnothing_at_all.so"),
    "no cameras": ("", of_model("realsense_gazebo_plugin", "<prefix>d435</prefix>"), "no sensor 'd435depth'"),
}  # fmt: skip

OURS = (
    "Sensor",
    "Plugin",
    "Model",
    "Target",
    "Camera",
    "Laser",
    "Hector",
    "Silent",
    "Bullet",
    "Link",
)


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


@pytest.fixture
def node(monkeypatch):
    node = Node(silence(monkeypatch))
    yield node
    node.sim.world.close()


@pytest.mark.parametrize("fault", BAD)
def test_an_impossible_sensor_is_told_in_a_line(node, fault):
    of_link, of_the_model, words = BAD[fault]
    [line] = node.spawn(MODEL.format(of_link, of_the_model))
    assert words in line
    assert "\n" not in line
    assert node.sim.now == 4_000_000


def test_nothing_of_a_model_with_all_sensors_stays_when_it_goes(node, root):
    """But for the last one, whose shapes rays know until the next cast."""
    text = (root / "test/data/sensors/bot.sdf").read_text(encoding="utf-8")
    counts = []
    for _ in range(4):
        node.spawn(text)
        gc.collect()
        assert not SilentPublisher.names and not SilentService.names
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
