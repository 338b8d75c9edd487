"""Pictures from another process: the same bits, and in real time frames are dropped, not time."""

import logging
import os
import signal
import threading
from contextlib import ExitStack
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from robot_sim.physics.engines import make_engine
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from robot_sim.sensors import picture_process
from robot_sim.sensors.noise import generator
from robot_sim.sensors.picture_process import PictureProcess
from robot_sim.sensors.pinhole import PinholeCamera, Shot
from robot_sim.sensors.rendering import PictureStream, RayRenderer, RendererError
from robot_sim.sensors.sensing import Sensing
from robot_sim.simulator import Simulator

BOUND = 60.0  # [s]
CAMERA = """<camera><image><width>40</width><height>30</height></image><clip><far>9</far></clip>
<noise><type>gaussian</type><stddev>0.02</stddev></noise></camera>"""
EYE = PinholeCamera(fromstring(CAMERA), Pose((0.0, 0.0, 0.4)), "here", "link")


class Scene:
    """A world with what renders it."""

    def __init__(self, lockstep):
        self.sim = Simulator(World(make_engine()), lockstep=lockstep)
        self.sim.world.spawn("ground_plane", ground_plane(), Pose())
        self.process = PictureProcess(self.sim, "rays")
        self.sensing = Sensing(self.sim, renderer=self.process)
        self.stream = PictureStream("the eye", self.process, self.sensing.schedule)
        self.sent = []

    def shot(self, **wanted):
        scene = self.sensing.visuals
        scene.expire()
        return Shot(EYE, Pose(), scene.scene.state(), noise=(0.0, generator(3)), **wanted)

    def take(self, name):
        """Takes a picture, which comes into `sent` under a name."""
        shots = [self.shot(colours=True)]
        with self.sim.lock:
            self.stream.take(shots, lambda views: self.sent.append((name, views[0])))

    def await_sent(self, count):
        for _ in range(int(BOUND / 0.001)):
            if len(self.sent) >= count:
                return
            threading.Event().wait(0.001)
        raise AssertionError(f"{len(self.sent)} of {count} pictures were sent")


@pytest.fixture
def make_scene():
    with ExitStack() as made:

        def make(lockstep=False):
            scene = Scene(lockstep)
            made.callback(scene.sim.world.close)
            return scene

        yield make


@pytest.fixture
def gate(monkeypatch):
    """Lets one picture through for each release; `at` counts those that have come."""
    held, at = threading.Semaphore(0), threading.Semaphore(0)
    ask = PictureProcess._ask

    def wait(self, shot):
        at.release()
        assert held.acquire(timeout=BOUND)
        return ask(self, shot)

    monkeypatch.setattr(PictureProcess, "_ask", wait)
    return held, at


@pytest.fixture
def world(make_scene):
    return make_scene(lockstep=True).sim.world


def test_its_pictures_have_the_bits_of_those_made_here(make_scene, put):
    scene = make_scene(lockstep=True)
    here = RayRenderer()
    world = scene.sim.world
    for change in (
        lambda: None,
        lambda: world.spawn("wall", put("other", "box", (1.0, 1.0, 1.0), tag="visual").description,
                            Pose((2.0, 0.0, 0.5))),
        lambda: world.models["wall"].place(Pose((3.0, 0.0, 0.5))),
        lambda: world.delete("wall"),
    ):  # fmt: skip
        change()
        expected = here.picture(scene.shot(image=True, colours=True, depths=True))
        with scene.sim.lock:
            found = scene.process.picture(scene.shot(image=True, colours=True, depths=True))
        for own, other in zip(expected, found, strict=True):
            np.testing.assert_array_equal(own, other)
        assert (found.image != found.colours).any()
        with scene.sim.lock:
            assert [each.size for each in scene.process.picture(scene.shot(depths=True))] == [
                0, 1200, 0,
            ]  # fmt: skip


def test_in_real_time_a_tick_waits_for_no_picture_and_the_newest_one_comes_next(
    make_scene, gate, monkeypatch, caplog
):
    held, at = gate
    monkeypatch.setattr(picture_process, "WINDOW", 0.0)
    scene = make_scene()
    with caplog.at_level(logging.WARNING):
        for part in range(3):
            scene.take("first")
            assert at.acquire(timeout=BOUND)
            for name in ("second", "third", "fourth"):
                scene.take(name)
            assert scene.stream.is_behind
            held.release(2)
            assert at.acquire(timeout=BOUND)
            scene.await_sent(2 * part + 2)
    assert [name for name, _ in scene.sent] == ["first", "fourth"] * 3
    [line] = caplog.messages
    assert "the eye" in line and "pictures a second of 40 x 30 are made" in line


def test_a_picture_from_before_a_reset_is_not_sent(make_scene, gate):
    held, at = gate
    scene = make_scene()
    scene.take("old")
    assert at.acquire(timeout=BOUND)
    scene.sim.reset_time()
    held.release(2)
    scene.take("new")
    scene.await_sent(1)
    assert [name for name, _ in scene.sent] == ["new"]


def test_what_is_closed_sends_nothing(make_scene, gate):
    held, at = gate
    scene = make_scene()
    for part in (scene.stream, scene.process):
        scene.take("late")
        assert at.acquire(timeout=BOUND)
        part.close()
        held.release()
        scene.stream = PictureStream("another", scene.process, scene.sensing.schedule)
    scene.process._thread.join(BOUND)
    assert not scene.process._thread.is_alive() and not scene.sent


def test_in_lockstep_time_waits_and_those_who_look_are_answered(make_scene, gate):
    held, at = gate
    scene = make_scene(lockstep=True)
    thread = threading.Thread(target=scene.take, args=("picture",))
    thread.start()
    assert at.acquire(timeout=BOUND)
    with scene.sim.lock.glance():
        assert not scene.sent and scene.sim.now == 0
    held.release()
    with scene.sim.lock:
        assert [name for name, _ in scene.sent] == ["picture"]
    thread.join(BOUND)


def test_an_ended_process_is_told_in_a_line(make_scene, caplog):
    scene = make_scene(lockstep=True)
    scene.take("picture")
    os.kill(scene.process._process[0].pid, signal.SIGKILL)
    for _ in range(2):
        with pytest.raises(RendererError, match="has ended: code -9"):
            scene.take("none")
    assert len(scene.sent) == 1
    scene = make_scene()
    scene.take("picture")
    scene.await_sent(1)
    os.kill(scene.process._process[0].pid, signal.SIGKILL)
    scene.take("none")
    scene.process._thread.join(BOUND)
    assert [each for each in caplog.messages if "Cameras are silent" in each]
