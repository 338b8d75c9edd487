"""Waits of Python's own, in simulated time: events, conditions, queues, timers, executors."""

import concurrent.futures
import queue
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import thread as pools

import pytest
import rospy
from support.ros.lockstep_world import MS, WAITS

from lockstep_runner import originals
from lockstep_runner.concurrency import python_threads
from lockstep_runner.replaced import python_time

BOUND = 30.0  # [s of wall time]


@pytest.fixture
def replaced(runner, put_back):
    executor = ThreadPoolExecutor
    put_back((executor, "submit"), (executor, "shutdown"), (pools._WorkItem, "run"), *WAITS)
    python_threads.replace_threads(runner)
    python_threads.replace_futures(runner)
    return runner


def closed():
    """A lock that is held: what waits for it waits in wall time."""
    lock = threading.Lock()
    lock.acquire()
    return lock


def passed(runner):
    return runner.clock.passed // MS


@pytest.mark.parametrize("uptime", [0.1, 0.3, 65_536.7, 67_003.123_456_789, 4e6 + 0.1])
def test_time_limits_end_whatever_the_clock_shows(runner, put_back, monkeypatch, uptime):
    """The sums of simulated and wall time are rounded: what is left of a limit may be 1e-11 s, not 0."""
    put_back(*WAITS)
    monkeypatch.setattr(python_threads.originals, "monotonic", lambda: uptime)
    python_threads.replace_threads(runner)
    condition = threading.Condition()
    waits = 0

    def never():
        nonlocal waits
        waits += 1
        assert waits < 200, "it never ends"
        return False

    for count in range(1, 20):
        with condition:
            assert not condition.wait_for(never, 0.1)
        assert passed(runner) == 100 * count


def test_time_limits_are_simulated(replaced):
    assert not threading.Event().wait(0.05)
    assert passed(replaced) == 50
    condition = threading.Condition()
    with condition:
        assert not condition.wait(0.05)
        assert not condition.wait_for(lambda: False, 0.1)
    assert passed(replaced) == 200
    with pytest.raises(queue.Empty):
        queue.Queue().get(timeout=0.1)
    assert passed(replaced) == 300
    full = queue.Queue(1)
    full.put(1)
    with pytest.raises(queue.Full):
        full.put(2, timeout=0.1)
    assert passed(replaced) == 400
    assert not threading.Semaphore(0).acquire(timeout=0.1)
    assert passed(replaced) == 500


def test_a_limit_holds_although_something_else_is_told_meanwhile(replaced):
    condition, told = threading.Condition(), []

    def tell():
        with condition:
            told.append(passed(replaced))
            condition.notify_all()

    for seconds in (0.02, 0.04):
        threading.Timer(seconds, tell).start()
    with condition:
        assert not condition.wait_for(lambda: len(told) > 2, timeout=0.1)
    assert (told, passed(replaced)) == ([20, 40], 100)


def test_timers_go_off_at_their_time_in_order(replaced):
    rung = []
    for number, seconds in enumerate((0.03, 0.01, 0.02)):
        threading.Timer(seconds, lambda n=number: rung.append((passed(replaced), n))).start()
    canceled = threading.Timer(0.005, lambda: rung.append("never"))
    canceled.start()
    canceled.cancel()
    threading.Event().wait(0.05)
    assert rung == [(10, 1), (20, 2), (30, 0)]


def test_a_queue_is_waited_for_as_long_as_it_takes(replaced):
    line = queue.Queue()
    threading.Timer(0.04, line.put, ["came"]).start()
    assert line.get() == "came"
    assert passed(replaced) <= 500  # looked at between calls


@pytest.mark.parametrize("workers", [1, 3])
def test_tasks_of_an_executor_take_the_time_that_they_sleep(replaced, workers):
    def work(number):
        replaced.wait(0.01 * (number + 1))
        return number, passed(replaced)

    with ThreadPoolExecutor(workers) as executor:
        results = list(executor.map(work, range(3)))
        task = executor.submit(work, 4)
        with pytest.raises(concurrent.futures.TimeoutError):
            task.result(timeout=0.01)
        assert task.result()[0] == 4
        assert next(concurrent.futures.as_completed([executor.submit(int)])).result() == 0
    assert passed(replaced) == {1: 110, 3: 80}[workers]  # none for the end of its threads
    ends = {1: [10, 30, 60], 3: [10, 20, 30]}[workers]
    assert results == list(zip(range(3), ends, strict=True))


@pytest.mark.parametrize("polls", [False, True])
def test_a_paused_world_ends_a_task_s_sleep_at_once(replaced, monkeypatch, polls):
    monkeypatch.setattr(time, "sleep", time.sleep)
    python_time.replace_time(replaced, virtual_wall_clock=False)
    replaced.world.paused = True
    begin = originals.monotonic()
    with ThreadPoolExecutor(1) as executor:
        task = executor.submit(lambda: [time.sleep(1000.0) for _ in range(3)])
        while polls and not task.done() and originals.monotonic() < begin + BOUND:
            time.sleep(0.001)
            assert not threading.Event().wait(0.01)
        replaced.wait(BOUND, task.done)
        replaced.clock.release_all()
    assert passed(replaced) == 0 and originals.monotonic() < begin + BOUND


def test_no_time_passes_while_a_task_computes(replaced):
    go, seen = closed(), []

    def work():
        assert go.acquire(timeout=BOUND)
        seen.append(passed(replaced))

    with ThreadPoolExecutor(1) as executor:
        executor.submit(work)
        waker = threading.Thread(target=lambda: (originals.sleep(0.2), go.release()))
        originals.start(waker)
        replaced.wait(1.0)
        originals.join(waker)
    assert seen == [0]


def test_what_libraries_wait_for_is_the_wall_s(replaced):
    names = {"__name__": "tensorboard.somewhere"}
    exec("def wait(event):\n    return event.wait(0.001)\n", names)
    assert not names["wait"](threading.Event())
    assert passed(replaced) == 0


def test_a_thread_that_hasn_t_started_can_t_be_joined_and_starts_once(replaced):
    thread = threading.Thread(target=int)
    with pytest.raises(RuntimeError):
        thread.join()
    thread.start()
    with pytest.raises(RuntimeError):
        thread.start()
    thread.join()
    assert not thread.is_alive()


def test_after_the_shutdown_waits_are_the_wall_s(replaced, monkeypatch):
    """A script that joins its threads at the end."""
    rests, go, ended = closed(), closed(), []

    def work():
        rests.release()
        assert go.acquire(timeout=BOUND)
        ended.append(replaced.wait(100.0))  # begins to rest when all have been released

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    assert rests.acquire(timeout=BOUND)
    replaced.clock.release_all()
    monkeypatch.setattr(rospy.core, "_shutdown_flag", True)
    go.release()
    thread.join()
    assert ended == [False]
    late = threading.Event()
    originals.start(threading.Thread(target=lambda: (originals.sleep(0.1), late.set())))
    assert late.wait(BOUND)
    assert passed(replaced) == 0


def test_a_shutdown_in_the_middle_of_a_wait_leaves_the_rest_to_the_wall(replaced, monkeypatch):
    """Ctrl-C while a thread is joined."""
    go, world = closed(), replaced.world

    def stop():
        if len(world.calls) == 4:
            monkeypatch.setattr(rospy.core, "_shutdown_flag", True)
            go.release()

    world.exchanged = stop
    ended = []

    def work():
        replaced.clock.ended(threading.current_thread())  # nobody waits for it
        assert go.acquire(timeout=BOUND)
        originals.sleep(0.2)
        ended.append(True)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join()
    assert ended == [True]
