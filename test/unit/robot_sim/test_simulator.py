"""The clockwork: lock-step, rates, and time that is held."""

import threading

import pytest
from support.robots.cartpole import CONTROLLERS, cartpole_urdf
from support.robots.worlds import add_robot, advance, start

from robot_sim.simulator import NotInLockstep, Simulator

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


@pytest.mark.parametrize("ticks", [0, -1])
def test_less_than_one_tick_is_refused(sim, ticks):
    with sim.lock, pytest.raises(ValueError, match="at least 1"):
        sim.advance(ticks)
    assert sim.now == 0


def test_a_world_that_runs_by_itself_cannot_be_stepped(sim):
    sim.lockstep = False
    with sim.lock, pytest.raises(NotInLockstep, match="lockstep:=true"):
        sim.advance(1)


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
