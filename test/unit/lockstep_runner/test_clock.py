"""The clock of a script's threads, with a world that is no more than a counter."""

import math
import threading

import pytest
import rospy
from hypothesis import given, settings
from hypothesis import strategies as st
from support.ros.lockstep_world import MS, Counter

from lockstep_runner import clock as module
from lockstep_runner.clock import Clock

BOUND = 30.0  # [s]


@pytest.fixture
def clock(monkeypatch):
    monkeypatch.setattr(rospy.rostime, "_rostime_current", None)
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", False)
    made = Clock(Counter())
    yield made
    made.release_all()


def beside(clock, work):
    """Starts a thread that the clock waits for."""
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    clock.began(thread)
    return thread


def test_a_wait_is_as_long_as_it_was_asked_for_in_whole_ticks(clock):
    for seconds in (0.05, 0.0004, 1.2, 0.0):
        before = clock.passed
        assert not clock.wait(seconds)
        assert clock.passed - before == math.ceil(seconds * 1000) * MS
    assert max(clock.world.calls) <= clock.world.longest


def test_a_wait_below_a_nanosecond_s_share_of_a_tick_ends(clock):
    assert not clock.wait(1e-9)
    assert clock.passed == MS


def test_a_call_that_is_left_in_the_middle_has_taken_its_time(clock):
    """A signal's handler raises."""

    def bell():
        clock.world.now += 500 * MS  # the simulator goes on
        clock.world.exchanged = lambda: None
        raise RuntimeError

    clock.wait(0.1)
    clock.world.exchanged = bell
    with pytest.raises(RuntimeError):
        clock.wait(0.5)
    assert clock.behind
    clock.exchange()
    assert (clock.passed, clock.behind) == (600 * MS, False)


def test_rospy_has_the_time(clock):
    clock.wait(0.25)
    assert rospy.get_rostime().to_sec() == 0.25


def test_a_wait_ends_when_what_it_waits_for_has_come(clock):
    assert clock.wait(math.inf, lambda: clock.world.now >= 700 * MS)
    assert clock.passed == 1000 * MS  # looked at between calls
    assert clock.wait(5.0, lambda: True)
    assert clock.passed == 1000 * MS


def test_a_paused_world_ends_sleeps_at_once_and_waits_for_events(clock):
    clock.world.paused = True
    assert not clock.wait(100.0)
    looks = []
    assert clock.wait(100.0, lambda: len(looks.append(1) or looks) > 3)
    assert clock.passed == 0


def test_a_world_that_is_unpaused_meanwhile_goes_on(clock):
    world = clock.world
    world.paused = True
    world.exchanged = lambda: setattr(world, "paused", len(world.calls) < 4)
    assert clock.wait(10.0, lambda: world.now >= 3 * MS)


def rest_in_threads(clock, spans):
    """Threads that sleep again and again; returns who woke when."""
    woken = []

    def sleeper(number, mine):
        for span in mine:
            clock.wait(span / 1000)
            woken.append((clock.passed // MS, number))
        clock.ended(threading.current_thread())

    threads = []
    for number, mine in enumerate(spans):
        threads.append(beside(clock, lambda n=number, m=mine: sleeper(n, m)))
        clock._let_others_finish()  # it rests before the next one begins
    clock.wait(sum(map(sum, spans)) / 1000 + 0.001)
    for thread in threads:
        thread.join(BOUND)
        assert not thread.is_alive()
    return woken


@settings(max_examples=25, deadline=None)
@given(st.lists(st.lists(st.integers(1, 40), min_size=1, max_size=5), min_size=1, max_size=4))
def test_sleepers_wake_when_they_asked_for_in_one_order(spans):
    one = rest_in_threads(Clock(Counter()), spans)
    expected = sorted(sum(mine[: count + 1]) for mine in spans for count in range(len(mine)))
    assert [at for at, _ in one] == expected
    for number, mine in enumerate(spans):
        assert [at for at, who in one if who == number] == [
            sum(mine[: count + 1]) for count in range(len(mine))
        ]
    assert rest_in_threads(Clock(Counter()), spans) == one


def test_no_time_passes_while_a_thread_computes(clock):
    go, seen = threading.Event(), []

    def work():
        clock.wait(0.01)
        go.wait(BOUND)
        seen.append(clock.passed)
        clock.ended(threading.current_thread())

    beside(clock, work)
    threading.Timer(0.2, go.set).start()
    clock.wait(1.0)
    assert seen == [10 * MS]


def test_a_thread_that_hangs_is_told_of_once_and_time_goes_on(clock, monkeypatch, capsys):
    monkeypatch.setattr(module, "THREAD_PATIENCE", 0.1)
    go = threading.Event()
    beside(clock, lambda: go.wait(BOUND))
    clock.wait(0.1)
    clock.wait(0.1)
    assert clock.passed == 200 * MS
    assert capsys.readouterr().err.count("time continues without it") == 1
    go.set()


def test_a_thread_that_dies_holds_nobody_up(clock):
    beside(clock, lambda: None).join()
    clock.wait(0.01)
    assert clock.passed == 10 * MS


def test_all_are_released_at_the_end(clock):
    done = []
    thread = beside(clock, lambda: done.append(clock.wait(1e6)))
    clock._let_others_finish()
    clock.release_all()
    thread.join(BOUND)
    assert done == [False]
