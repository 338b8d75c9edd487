"""The clockwork: lock-step, rates, time that is held, and the lock that serves its waiters in turn."""

import threading
from functools import partial
from unittest.mock import Mock

import pytest
from support.robots.cartpole import CONTROLLERS, cartpole_urdf
from support.robots.worlds import add_robot, advance, start

from robot_sim.simulator import NotInLockstep, Simulator
from robot_sim.timing import FairLock, Holds

BOUND = 60.0  # [s]


def make_robot(sim):
    robot = add_robot(sim, "cartpole", cartpole_urdf())
    start(robot, CONTROLLERS)
    return robot


def test_an_effort_is_reported_on_the_tick_after_it_acted(sim):
    robot = make_robot(sim)
    samples = []
    robot.manager.get("states").outputs[0].sink = samples.append
    robot.manager.get("cart").command(0.02)
    advance(sim, 20)
    assert samples[0].efforts == (0.0, 0.0)
    assert samples[1].efforts[1] != 0.0
    assert abs(samples[1].efforts[1]) <= 30.0


def test_lock_step_is_bit_for_bit_repeatable_across_resets(sim):
    robot = make_robot(sim)
    runs = []
    for _ in range(3):
        sim.reset_simulation()
        track = []
        for step in range(100):
            robot.manager.get("cart").command(0.02 * (step % 7))
            advance(sim, 8)
            joints = robot.hardware.joints.values()
            track.append([(each.position, each.velocity, each.effort) for each in joints])
        runs.append(track)
    assert runs[0] == runs[1] == runs[2]


def test_less_than_one_tick_is_refused_and_all_in_a_world_that_runs_by_itself(sim):
    for ticks in (0, -1):
        with pytest.raises(ValueError, match="at least 1"):
            sim.advance(ticks)
    sim.lockstep = False
    with pytest.raises(NotInLockstep, match="lockstep:=true"):
        sim.advance(1)
    assert sim.now == 0


def test_a_slow_rate_can_be_changed_and_stopped_at_once(sim):
    sim = Simulator(sim.world, max_update_rate=5e-324)
    thread = threading.Thread(target=sim.run)
    thread.start()
    ticking = threading.Event()
    sim.listeners.append(lambda now: ticking.set() if now > 2_000_000 else None)
    sim.max_update_rate = 1000.0
    assert ticking.wait(BOUND)
    sim.max_update_rate = 1e-12
    sim.stop()
    thread.join(BOUND)
    assert not thread.is_alive()


@pytest.mark.parametrize(
    ("options", "rate", "paused", "outruns"),
    [
        ({"lockstep": True}, 1000.0, False, True),
        ({}, 1000.0, False, False),
        ({}, 500.0, False, False),
        ({}, 2000.0, False, True),
        ({}, 0.0, False, True),
        ({}, 1000.0, True, True),  # only gz world moves it then
    ],
)
def test_it_knows_when_it_is_faster_than_the_clock(sim, options, rate, paused, outruns):
    sim = Simulator(sim.world, **options)
    assert sim.outruns_the_clock == sim.lockstep
    sim.max_update_rate = rate
    if paused:
        sim.pause()
    assert sim.outruns_the_clock == outruns


def test_steps_wait_for_the_end_of_a_hold_and_services_do_not(sim):
    sim.lockstep = False
    done = threading.Event()
    thread = threading.Thread(target=lambda: (sim.step(3), done.set()))
    with sim.holds.hold(60.0, _never), sim.holds.hold(60.0, _never):
        thread.start()
        for _ in range(100):
            with sim.lock:
                assert sim.now == 0
        assert not done.is_set()
    assert done.wait(BOUND)
    thread.join(BOUND)
    assert sim.now == 3_000_000


def test_time_goes_on_when_a_hold_lasts_too_long(sim):
    told = threading.Event()
    with sim.holds.hold(0.01, told.set):
        assert told.wait(BOUND)
        sim.lockstep = False
        sim.step(1)
        assert sim.now == 1_000_000
    assert not sim.holds


def _never():
    raise AssertionError("too late")


def test_it_is_held_for_the_block_alone_and_not_where_no_thread_is_left(monkeypatch):
    holds = Holds(FairLock(), lambda: None)
    with holds.hold(60.0, _never):
        assert holds
    with pytest.raises(ZeroDivisionError), holds.hold(60.0, _never):
        raise ZeroDivisionError
    assert not holds
    none_left = Mock(side_effect=RuntimeError("can't start new thread"))
    monkeypatch.setattr(threading.Thread, "start", none_left)
    with pytest.raises(RuntimeError, match="can't start"), holds.hold(60.0, _never):
        raise AssertionError("the block is not reached")
    assert not holds
    holds.await_end(threading.Event())


def queue_up(lock, *actions):
    """Starts threads, each of which asks for the lock before the next one starts."""
    threads = [threading.Thread(target=action) for action in actions]
    for count, thread in enumerate(threads):
        thread.start()
        while len(lock._waiting) <= count:
            threading.Event().wait(0.001)
    return threads


def test_the_lock_is_handed_on_in_the_order_of_asking():
    lock, order = FairLock(), []

    def take(name):
        with lock:
            order.append(name)

    with lock:
        threads = queue_up(lock, *(partial(take, name) for name in range(5)))
    for thread in threads:
        thread.join(BOUND)
    assert order == [0, 1, 2, 3, 4]


def test_a_busy_simulation_does_not_keep_others_out():
    lock, done = FairLock(), threading.Event()

    def spin():
        while not done.is_set():
            with lock:
                pass

    thread = threading.Thread(target=spin)
    thread.start()
    for _ in range(100):
        with lock:
            pass
    done.set()
    thread.join(BOUND)
    assert not thread.is_alive()


def test_a_lent_lock_serves_those_who_only_look_and_then_goes_back():
    lock, order = FairLock(), []
    looked = threading.Event()

    def change():
        with lock:
            order.append("changed")

    def look():
        with lock.glance():
            order.append("looked")
        looked.set()

    with lock:
        mine = lock.holder
        threads = queue_up(lock, change, look)
        with lock.lent():
            assert looked.wait(BOUND)
            assert lock.holder is None
            with lock.glance():
                order.append("looked again")
        assert lock.holder == mine
        order.append("went on")
    for thread in threads:
        thread.join(BOUND)
    assert order == ["looked", "looked again", "went on", "changed"]
