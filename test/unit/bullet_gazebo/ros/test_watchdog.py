"""Whatever ends the thread that moves the world is told, and ends the node."""

from __future__ import annotations

import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest
import rospy

from bullet_gazebo.ros.node.gzserver import GazeboNode
from bullet_gazebo.ros.node.watchdog import Watchdog
from bullet_gazebo.timing import FairLock

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


@pytest.mark.parametrize(
    "error",
    [
        ZeroDivisionError("zero"),
        SystemExit("x"),
        SystemExit(),
        KeyboardInterrupt(),
        GeneratorExit(),
    ],
    ids=repr,
)
def test_whatever_is_raised_in_the_thread_is_a_fault_and_told(error, told) -> None:
    watchdog = Watchdog(FakeSimulator(raises(error)))
    watchdog.start()
    watchdog._thread.join(BOUND)
    assert watchdog.barks()
    assert len(told) == 1
    assert type(error).__name__ in told[0] and "Traceback" in told[0]


def test_a_thread_that_ends_without_a_word_is_a_fault_too(told) -> None:
    watchdog = Watchdog(FakeSimulator(lambda: None))
    watchdog.start()
    watchdog._thread.join(BOUND)
    assert watchdog.barks() and watchdog.barks()
    assert len(told) == 1


def test_so_is_one_that_can_not_even_tell(monkeypatch) -> None:
    texts: list[str] = []

    def fails_first(text: str, *args: object) -> None:
        if not texts:
            texts.append("")
            raise MemoryError
        texts.append(text)

    monkeypatch.setattr(rospy, "logfatal", fails_first)
    monkeypatch.setattr(threading, "excepthook", lambda args: None)
    watchdog = Watchdog(FakeSimulator(raises(ValueError())))
    watchdog.start()
    watchdog._thread.join(BOUND)
    assert watchdog.barks()


def test_a_fault_of_somebody_else_who_moves_the_world_counts(told) -> None:
    watchdog = Watchdog(FakeSimulator())
    watchdog.start()
    assert not watchdog.barks()
    with pytest.raises(SystemExit), watchdog:
        raise SystemExit("in a step")
    assert watchdog.barks() and "in a step" in told[0]
    watchdog.stop()


def test_a_world_that_is_stopped_has_not_failed(told) -> None:
    sim = FakeSimulator()
    watchdog = Watchdog(sim)
    watchdog.start()
    assert sim.running.wait(BOUND)
    watchdog.stop()
    assert not watchdog._thread.is_alive()
    assert not watchdog.barks() and not told


def test_a_tick_that_meets_closed_topics_at_the_end_is_no_fault(told, monkeypatch) -> None:
    watchdog = Watchdog(FakeSimulator(raises(rospy.ROSException("publish() to a closed topic"))))
    monkeypatch.setattr(rospy, "is_shutdown", lambda: True)
    watchdog.start()
    watchdog.stop()
    watchdog._thread.join(BOUND)
    assert not watchdog.barks() and not told


def test_it_may_be_stopped_before_it_was_started_and_from_its_own_thread() -> None:
    sim = FakeSimulator()
    watchdog = Watchdog(sim)
    watchdog.stop()
    watchdog.start()
    watchdog._thread.join(BOUND)
    assert not watchdog.barks()
    sim = FakeSimulator()
    own = Watchdog(sim)
    sim._run = own.stop
    own.start()
    own._thread.join(BOUND)
    assert not own.barks()


def test_no_time_passes_once_a_signal_has_come(monkeypatch) -> None:
    monkeypatch.setattr(rospy, "on_shutdown", lambda hook: None)
    node, sim = object.__new__(GazeboNode), FakeSimulator()
    node._watchdog, node._recorder = Watchdog(sim), None
    signals = SimpleNamespace(noted=lambda: True, wait=lambda over: over())
    assert node.run(signals) == 0
    assert sim.stopping.is_set() and not sim.running.is_set()


def test_a_process_whose_threads_do_not_end_ends_all_the_same_with_its_exit_code() -> None:
    code = (
        "import threading; from bullet_gazebo.ros.common.node_process import end_within;"
        "threading.Thread(target=threading.Event().wait).start(); end_within(0.1, 7)"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], check=False, timeout=BOUND, capture_output=True
    )
    assert result.returncode == 7
    assert b"doesn't end" in result.stderr
