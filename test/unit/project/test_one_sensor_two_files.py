"""A sensor is two files, its measurement and its plugin: all else finds it by them."""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bullet_gazebo_msgs.msg import SceneSensor
from sensor_msgs.msg import Temperature
from support.ros.silent_topics import SilentPublisher, SilentSubscriber, silence
from support.scenes.rover import PARTS, ROVER
from support.scenes.seeing_rover import Look, sensor

import bullet_gazebo.plugins
import robot_sim.sensors
from bullet_gazebo.common.messages import to_reading
from bullet_gazebo.plugins.plugin_loader import PluginRegistry
from bullet_gazebo.window.sensor_panel import drawn_as
from robot_envs import RobotEnv, StateQuery
from robot_envs.backends.ros import sensor_listener
from robot_envs.backends.ros.sensor_listener import SensorListener
from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World
from robot_sim.sensors.sensing import Sensing
from robot_sim.sensors.sensor_readers import SensorReaders, measurements
from robot_sim.simulator import Simulator

FOLDERS = {robot_sim.sensors: "sensors", bullet_gazebo.plugins: "plugins"}
WARM = sensor("warm", "thermometer", 50, "", "x").replace("libgazebo_ros_x.so", "libthermometer.so")
ROBOT = replace(ROVER, urdf=f'<robot name="warm">{"".join([*PARTS, WARM])}</robot>')
WANTED = 300.0 - 10.0 * 0.22


@pytest.fixture(autouse=True)
def invented(root: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    def forget() -> None:
        measurements.cache_clear()
        sensor_listener.sources.cache_clear()
        for name in [each for each in sys.modules if each.rpartition(".")[2].startswith("thermom")]:
            del sys.modules[name]

    for package, folder in FOLDERS.items():
        there = str(root / "test/support/invented" / folder)
        monkeypatch.setattr(package, "__path__", [*package.__path__, there])
    forget()
    yield
    monkeypatch.undo()
    forget()


class Warm(Look):
    query = StateQuery(sensors=("warm",))

    def observe(self, state: Any) -> np.ndarray:
        return np.resize(state.sensors["warm"].temperature, 25)


def test_a_task_sees_it_with_noise() -> None:
    exact, noisy = (RobotEnv(ROBOT, Warm(), sensor_noise=noise) for noise in (0.0, {"warm": 0.5}))
    seen, wrong = (float(env.reset(seed=1)[0][0]) for env in (exact, noisy))
    assert seen == pytest.approx(WANTED, abs=0.5)
    assert 0.0 < abs(wrong - seen) < 3.0
    exact.close()
    noisy.close()


def test_it_has_a_topic_that_listeners_and_windows_read(monkeypatch: pytest.MonkeyPatch) -> None:
    silence(monkeypatch)
    sim = Simulator(World(make_engine()), lockstep=True)
    shown: list[SceneSensor] = []
    plugins = PluginRegistry(sim, None, shown=shown)  # type: ignore[arg-type]
    model = sim.world.spawn("warm", parse_urdf(str(ROBOT.urdf)), Pose((0.0, 0.0, 0.1)))
    plugins.load(model, "/")
    readers = SensorReaders(sim, Sensing(sim), ["warm"])
    with sim.lock:
        sim.advance(25)
    message = SilentPublisher.messages["/temperature"][-1]
    assert isinstance(message, Temperature)
    assert message.temperature == pytest.approx(WANTED + 1, abs=1)
    [taken] = readers.read()
    said = to_reading(taken.now, taken.values).values[0]
    assert said.name == "temperature" and len(said.data) == 8
    listener = SensorListener(ROBOT, ("warm",), lambda: 0.0)
    SilentSubscriber.send("/temperature", message)
    assert listener.read(0.0)["warm"].temperature == pytest.approx([message.temperature])
    assert [each.topic for each in shown] == ["/temperature"]
    kind, draw = drawn_as(shown[0].kind) or (None, None)
    assert kind is Temperature and draw is not None
    assert f"temperature: {message.temperature}" in draw(message).text
    plugins.unload(model)
    sim.world.close()
