"""Locks of the script: a thread that waits for one doesn't compute, and what it waits for may need time."""

import threading

import pytest
from support.ros.lockstep_world import MS, WAITS

from lockstep_runner import originals
from lockstep_runner.concurrency import python_locks, python_threads

KINDS = ["Lock", "RLock"]


@pytest.fixture
def replaced(runner, put_back):
    put_back((threading, "Lock"), (threading, "RLock"), *WAITS)
    python_threads.replace_threads(runner)
    python_locks.install(runner)
    return runner


@pytest.mark.parametrize("kind", KINDS)
def test_who_holds_a_lock_and_waits_for_who_wants_it_goes_on(replaced, kind, capsys):
    """As a service call under a lock, whose messages' callback takes the lock."""
    lock, order = getattr(threading, kind)(), []

    def callback():
        with lock:
            order.append("callback")

    with lock:
        thread = threading.Thread(target=callback)
        thread.start()
        replaced.clock.wait(0.05)
        order.append("main")
    thread.join(1.0)
    assert order == ["main", "callback"]
    assert replaced.clock.passed == 50 * MS
    assert not capsys.readouterr().err


@pytest.mark.parametrize("kind", KINDS)
def test_time_passes_for_who_holds_what_the_main_thread_wants(replaced, kind):
    lock = getattr(threading, kind)()

    def sleeps():
        with lock:
            replaced.wait(0.2)

    thread = threading.Thread(target=sleeps)
    thread.start()
    replaced.clock.wait(0.05)
    assert not lock.acquire(blocking=False)
    assert not lock.acquire(timeout=0.05)
    assert replaced.clock.passed == 100 * MS
    with lock:
        assert replaced.clock.passed == 200 * MS
    thread.join()


def test_no_time_passes_for_a_thread_that_the_clock_does_not_know(replaced):
    lock = threading.Lock()

    def keeps():
        with lock:
            originals.sleep(0.2)

    thread = threading.Thread(target=keeps)
    originals.start(thread)
    while not lock.locked():
        originals.sleep(0.001)
    before = replaced.clock.passed
    with lock:
        assert replaced.clock.passed == before
    originals.join(thread)


@pytest.mark.parametrize("kind", KINDS)
def test_they_are_as_python_s(replaced, kind):
    lock = getattr(threading, kind)()
    with pytest.raises(RuntimeError):
        lock.release()
    with pytest.raises(ValueError, match="timeout"):
        lock.acquire(blocking=False, timeout=1.0)
    assert lock.acquire()
    again = lock.acquire(blocking=False)
    assert again == (kind == "RLock")
    if again:
        lock.release()
    lock.release()
    condition = threading.Condition(lock)
    with pytest.raises(RuntimeError):
        condition.wait(0.1)
    with condition:
        if kind == "RLock":
            lock.acquire()  # is given back as a whole
        assert not condition.wait(0.1)
        if kind == "RLock":
            lock.release()
    assert replaced.clock.passed == 100 * MS
    assert lock.acquire(timeout=0.1)
    lock.release()


def test_a_lock_may_be_given_back_by_another_thread(replaced):
    lock = threading.Lock()
    lock.acquire()
    assert lock.locked()
    thread = threading.Thread(target=lock.release)
    thread.start()
    thread.join()
    assert not lock.locked()
