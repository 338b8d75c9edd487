"""A world that fails ends the node; whoever keeps its lock is named."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest
import rospy
from support.python import run_python

from bullet_gazebo.node import watchdog as module
from bullet_gazebo.node.gzserver import GazeboNode
from bullet_gazebo.node.watchdog import StallWatch, Watchdog
from bullet_gazebo.plugins.plugin_loader import PluginContext
from robot_sim.control.controllers.base import Controller
from robot_sim.physics.description import Plugin
from robot_sim.physics.engines import make_engine
from robot_sim.physics.world import World
from robot_sim.simulator import Simulator
from robot_sim.timing import FairLock

BOUND = 60.0  # [s]


class FakeSimulator:
    """Runs until it is stopped, or does what it is told to instead."""

    def __init__(self, run=None) -> None:
        self.lock, self.now = FairLock(), 0
        self.stopping = threading.Event()
        self.running = threading.Event()
        self._run = run

    def run(self) -> None:
        self.running.set()
        if self._run is not None:
            self._run()
        else:
            self.stopping.wait(BOUND)

    def stop(self) -> None:
        self.stopping.set()


@pytest.fixture
def told(monkeypatch) -> list[str]:
    """What was logged as fatal."""
    texts: list[str] = []
    monkeypatch.setattr(rospy, "logfatal", lambda text, *args: texts.append(text % args))
    return texts


def raises(error: BaseException):
    def run() -> None:
        raise error

    return run


def ended(sim: FakeSimulator) -> Watchdog:
    """A watchdog whose thread has ended by itself."""
    watchdog = Watchdog(sim)
    watchdog.start()
    watchdog._thread.join(BOUND)
    assert not watchdog._thread.is_alive()
    return watchdog


@pytest.mark.parametrize(
    "error",
    [ZeroDivisionError("0"), SystemExit("x"), SystemExit(), KeyboardInterrupt(), GeneratorExit()],
    ids=repr,
)
def test_whatever_is_raised_in_the_thread_is_a_fault_and_told(error, told) -> None:
    watchdog = ended(FakeSimulator(raises(error)))
    assert watchdog.failed() and watchdog.failed()
    assert len(told) == 1
    assert type(error).__name__ in told[0] and "Traceback" in told[0]


def test_a_thread_that_ends_without_a_word_is_a_fault_too(told) -> None:
    assert ended(FakeSimulator(lambda: None)).failed()


def test_a_fault_of_somebody_else_who_moves_the_world_counts(told) -> None:
    watchdog = Watchdog(FakeSimulator())
    watchdog.start()
    assert not watchdog.failed()
    with pytest.raises(SystemExit), watchdog:
        raise SystemExit("in a step")
    assert watchdog.failed() and "in a step" in told[0]
    watchdog.stop()


def test_a_world_that_is_stopped_has_not_failed(told) -> None:
    sim = FakeSimulator()
    watchdog = Watchdog(sim)
    watchdog.start()
    assert sim.running.wait(BOUND)
    watchdog.stop()
    watchdog._thread.join(BOUND)
    assert not watchdog._thread.is_alive()
    assert not watchdog.failed() and not told


def test_a_tick_that_meets_closed_topics_at_the_end_is_no_fault(told, monkeypatch) -> None:
    watchdog = Watchdog(FakeSimulator(raises(rospy.ROSException("publish() to a closed topic"))))
    monkeypatch.setattr(rospy, "is_shutdown", lambda: True)
    watchdog.start()
    watchdog.stop()
    watchdog._thread.join(BOUND)
    assert not watchdog.failed() and not told


def test_it_may_be_stopped_before_it_was_started_and_from_its_own_thread() -> None:
    sim = FakeSimulator()
    watchdog = Watchdog(sim)
    watchdog.stop()
    watchdog.start()
    watchdog._thread.join(BOUND)
    assert not watchdog.failed()
    sim = FakeSimulator()
    own = Watchdog(sim)
    sim._run = own.stop
    own.start()
    own._thread.join(BOUND)
    assert not own.failed()


def test_no_time_passes_once_a_signal_has_come(monkeypatch) -> None:
    monkeypatch.setattr(rospy, "on_shutdown", lambda hook: None)
    node, sim = object.__new__(GazeboNode), FakeSimulator()
    node._watchdog, node._recorders = Watchdog(sim), []
    signals = SimpleNamespace(noted=lambda: True, wait=lambda over: over())
    assert node.run(signals) == 0
    assert sim.stopping.is_set() and not sim.running.is_set()


def test_a_process_whose_threads_do_not_end_ends_all_the_same_with_its_exit_code() -> None:
    code = (
        "import threading; from bullet_gazebo.common.node_process import end_within;"
        "threading.Thread(target=threading.Event().wait).start(); end_within(0.1, 7)"
    )
    result = run_python(code, check=False, timeout=BOUND)
    assert result.returncode == 7
    assert "doesn't end" in result.stderr


class Stalled:
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
def setting() -> Stalled:
    return Stalled()


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
    assert "a thread that has ended without releasing it" in setting.told[0]


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
    model = SimpleNamespace(name="robot")
    PluginContext(sim, model, plugin, None, None, "robot", None, None).on_update(code.update)
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
    monkeypatch.setattr(module, "LOCK_PATIENCE", 0.5)
    sim, code = Simulator(World(make_engine())), Stuck()
    name = add(sim, code)
    watchdog = Watchdog(sim)
    watchdog.start()
    deadline = time.monotonic() + BOUND
    while not told and time.monotonic() < deadline:
        assert not watchdog.failed()
        time.sleep(0.05)
    watchdog.stop()
    hanging = watchdog.left_hanging()
    code.enough.set()
    watchdog._thread.join(BOUND)
    assert name in told[0] and "in thread 'simulation'" in told[0] and "in update" in told[0]
    assert hanging is not None and name in hanging


@pytest.mark.parametrize("lockstep", [True, False])
def test_it_says_that_the_world_computes_and_not_that_it_waits(lockstep: bool) -> None:
    sim = FakeSimulator()
    sim.lockstep = lockstep
    watchdog, stage, done = Watchdog(sim), threading.Barrier(2), threading.Event()

    def work() -> None:
        with sim.lock:
            stage.wait(BOUND)
            stage.wait(BOUND)  # until it has been seen to wait
            while not done.is_set():
                pass

    thread = threading.Thread(target=work)
    thread.start()
    stage.wait(BOUND)
    first = watchdog.work()
    assert watchdog.work() == first
    stage.wait(BOUND)
    deadline = time.monotonic() + (BOUND if lockstep else 0.1)
    while watchdog.work() == first and time.monotonic() < deadline:
        time.sleep(0.01)
    assert (watchdog.work() != first) == lockstep
    done.set()
    thread.join()
