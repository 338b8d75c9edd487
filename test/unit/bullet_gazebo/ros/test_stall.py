"""Who keeps the world's lock for ever is told, by name; who is slow, paused or suspended is not."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest
import rospy

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.physics.description import Plugin
from bullet_gazebo.physics.engines import make_engine
from bullet_gazebo.physics.world import World
from bullet_gazebo.ros.node import stall
from bullet_gazebo.ros.node.stall import StallWatch
from bullet_gazebo.ros.node.watchdog import Watchdog
from bullet_gazebo.ros.plugins import PluginContext
from bullet_gazebo.simulator import Simulator
from bullet_gazebo.timing import FairLock

BOUND = 60.0  # [s]


class Setting:
    """A watch over a world that nothing moves, and the clock that it reads."""

    def __init__(self) -> None:
        self.sim = SimpleNamespace(lock=FairLock(), now=0)
        self.time = 0.0
        self.told: list[str] = []
        self.watch = StallWatch(self.sim, self.told.append, lambda: self.time)

    def look(self, seconds: float, pause: float = 0.1) -> None:
        """Looks for so long, with so much time between two looks."""
        for _ in range(round(seconds / pause)):
            self.time += pause
            self.watch.look()


@pytest.fixture
def setting() -> Setting:
    return Setting()


@contextmanager
def held(lock: FairLock) -> Iterator[None]:
    """By a thread of its own, in `keeps_it`."""
    taken, enough = threading.Event(), threading.Event()

    def keeps_it() -> None:
        with lock:
            taken.set()
            enough.wait(BOUND)

    thread = threading.Thread(target=keeps_it, name="rude")
    thread.start()
    assert taken.wait(BOUND)
    yield
    enough.set()
    thread.join(BOUND)


def test_a_lock_that_is_kept_is_told_once_with_its_holder(setting) -> None:
    with held(setting.sim.lock):
        setting.look(9.0)
        assert not setting.told
        setting.look(300.0)
    assert len(setting.told) == 1
    assert "in thread 'rude'" in setting.told[0] and "in keeps_it" in setting.told[0]
    assert "Time stands still" in setting.told[0].splitlines()[0]
    setting.look(1.0)
    with held(setting.sim.lock):
        setting.look(20.0)
    assert len(setting.told) == 2


def test_one_that_is_free_or_taken_again_and_again_is_in_order(setting) -> None:
    setting.look(100.0)
    for _ in range(100):
        with held(setting.sim.lock):
            setting.look(5.0)
    assert not setting.told


def test_one_under_which_time_passes_is_too(setting) -> None:
    with held(setting.sim.lock):
        for _ in range(100):
            setting.sim.now += 1
            setting.look(5.0)
    assert not setting.told


def test_time_in_which_this_process_was_suspended_does_not_count(setting) -> None:
    with held(setting.sim.lock):
        setting.look(3600.0, pause=720.0)
        assert not setting.told
        setting.look(10.0)
    assert len(setting.told) == 1


def test_a_thread_that_ended_with_the_lock_is_named_as_that(setting) -> None:
    thread = threading.Thread(target=setting.sim.lock.__enter__)
    thread.start()
    thread.join(BOUND)
    setting.look(20.0)
    assert "a thread that has ended without letting go of it" in setting.told[0]


class Stuck:
    """A user's code that waits for what never comes, until the test has seen enough."""

    def __init__(self) -> None:
        self.enough = threading.Event()

    def update(self, now: int) -> None:
        self.enough.wait(BOUND)


class StuckController(Controller):
    type_name, interface = "mine/Stuck", "hardware_interface/EffortJointInterface"

    @classmethod
    def create(cls, name, params, hardware):
        raise NotImplementedError

    def update(self, now: int, dt: float) -> None:
        self.code.update(now)


def add_plugin(sim: Simulator, code: Stuck) -> str:
    plugin = Plugin("librude.so", "rude", ElementTree.Element("plugin"))
    context = PluginContext(sim, SimpleNamespace(name="robot"), plugin, "robot")
    context.on_update(code.update)
    return "plugin librude.so of model 'robot'"


def add_controller(sim: Simulator, code: Stuck) -> str:
    controller = StuckController("arm")
    controller.code = code
    sim.listeners.append(lambda now: controller.update(now, 0.001))
    return "controller 'arm' (mine/Stuck)"


@pytest.mark.parametrize("add", [add_plugin, add_controller])
def test_in_a_world_plugin_and_controller_are_named_and_the_end_does_not_wait_for_them(
    add: Callable[[Simulator, Stuck], str], monkeypatch
) -> None:
    told: list[str] = []
    monkeypatch.setattr(rospy, "logwarn", told.append)
    monkeypatch.setattr(stall, "PATIENCE", 0.5)
    sim, code = Simulator(World(make_engine())), Stuck()
    name = add(sim, code)
    watchdog = Watchdog(sim)
    watchdog.start()
    deadline = time.monotonic() + BOUND
    while not told and time.monotonic() < deadline:
        assert not watchdog.barks()
        time.sleep(0.05)
    watchdog.stop()
    hanging = watchdog.left_hanging()
    code.enough.set()
    watchdog._thread.join(BOUND)
    assert name in told[0] and "in thread 'simulation'" in told[0] and "in update" in told[0]
    assert hanging is not None and name in hanging
