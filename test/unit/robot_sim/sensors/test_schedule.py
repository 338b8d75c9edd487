"""When sensors measure (docs/contract/sensors.md 0.4)."""

import threading

import pytest

from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.sensors.schedule import Schedule

MS = 1_000_000
AT_REST = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
BALL = """<robot name="ball"><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


class Sensor:
    """A sensor with listeners, and the times of its measurements."""

    def __init__(self, sim, schedule, model, rate, measure=None, **options):
        self._sim, self._schedule = sim, schedule
        self.times = []
        self.listeners = 0
        measure = measure or self.times.append
        with sim.lock:
            self.clock = schedule.begin(model, rate, measure, lambda: self.listeners > 0, **options)

    def come(self):
        self.listeners += 1
        self.clock.has_newcomer = True
        self._review()

    def go(self):
        self.listeners -= 1
        self._review()

    def _review(self):
        with self._sim.lock:
            self._schedule.review()


@pytest.fixture
def schedule(sim):
    return Schedule(sim)


def spawn(sim, name):
    with sim.lock:
        return sim.world.spawn(name, parse_urdf(BALL), Pose())


@pytest.fixture
def model(sim):
    return spawn(sim, "ball")


@pytest.fixture
def make(sim, schedule, model):
    """Makes a sensor that the ball carries, or another model `on`."""
    return lambda *args, on=model, **options: Sensor(sim, schedule, on, *args, **options)


def advance(sim, ticks):
    with sim.lock:
        sim.advance(ticks)


def test_measurements_come_with_the_period_and_do_not_drift(sim, make):
    sensor = make(300.0)  # every 3.333333 ms
    sensor.come()
    advance(sim, 100)
    assert sensor.times == [0, *(-(-k * 3_333_333 // MS) * MS for k in range(1, 31))]


def test_without_a_rate_every_step_is_measured(sim, make):
    sensor = make(0.0)
    sensor.come()
    advance(sim, 3)
    assert sensor.times == [0, MS, 2 * MS, 3 * MS]


def test_nobody_listening_costs_the_tick_nothing(sim, make):
    before = list(sim.listeners)
    sensor = make(100.0)
    advance(sim, 50)
    assert sim.listeners == before and not sensor.times
    sensor.come()
    assert sim.listeners != before
    sensor.go()
    assert sim.listeners == before


def test_a_newcomer_gets_a_measurement_at_once_and_changes_no_later_one(sim, make):
    advance(sim, 4)
    sensor = make(100.0)
    advance(sim, 13)
    sensor.come()
    advance(sim, 12)
    assert sensor.times == [17 * MS, 24 * MS]
    sensor.come()  # less than a period after the last measurement
    assert sensor.times == [17 * MS, 24 * MS]
    advance(sim, 5)
    sensor.go()
    sensor.go()
    advance(sim, 20)
    sensor.come()
    assert sensor.times[2:] == [34 * MS, 54 * MS]


def test_one_that_compares_measurements_begins_when_it_is_due(sim, make):
    sensor = make(100.0, at_once=False)
    advance(sim, 13)
    sensor.come()
    advance(sim, 10)
    assert sensor.times == [20 * MS]


def test_sensors_measure_in_the_order_in_which_they_were_added(sim, make):
    order = []
    second = make(100.0, lambda now: order.append("first"), at_once=False)
    first = make(200.0, lambda now: order.append("second"), at_once=False)
    first.come()
    second.come()
    advance(sim, 10)
    assert order == ["second", "first", "second"]


def test_resets_and_moves_measure_at_once_what_is_heard(sim, make, model):
    sensor = make(100.0, at_once=False)
    sensor.come()
    advance(sim, 15)
    sim.reset_world()
    with sim.lock:
        sim.place_model(model, Pose((0.0, 0.0, 1.0)), AT_REST)
    assert sensor.times == [10 * MS, 15 * MS, 15 * MS]
    sim.reset_simulation()
    advance(sim, 10)
    assert sensor.times[3:] == [0, 10 * MS]


def test_a_move_of_a_model_measures_what_it_carries_and_nothing_else(sim, schedule, make, model):
    """Else a laser of 5 Hz measures as often as an obstacle is moved, and a learner steps too early."""
    obstacle, attached = spawn(sim, "obstacle"), spawn(sim, "attached")
    own, other, far = make(5.0), make(5.0, on=obstacle), make(5.0, on=attached)
    for each in (own, other, far):
        each.come()
    for _ in range(10):
        advance(sim, 100)
        with sim.lock:
            sim.place_model(obstacle, Pose((5.0, 0.0, 1.0)), AT_REST)
    assert own.times == far.times == [n * 200 * MS for n in range(6)]
    assert len(other.times) == 16
    assert schedule.last_move(model).number == 0 < schedule.last_move(obstacle).number
    with sim.lock:
        sim.world.attach((obstacle, "b"), (attached, "b"))
        sim.place_link(obstacle, "b", Pose((5.0, 0.0, 1.0)), AT_REST)
    assert (len(own.times), len(other.times), len(far.times)) == (6, 17, 7)


def test_several_moves_of_one_request_measure_once(sim, make, model):
    sensor = make(100.0, at_once=False)
    sensor.come()
    with sim.lock, sim.moves.as_one():
        sim.reset(everything=False)
        sim.place_model(model, Pose((0.0, 0.0, 1.0)), AT_REST)
    assert sensor.times == [0]


def test_who_comes_after_a_reset_gets_what_there_is_now(sim, make):
    sensor = make(10.0)
    sensor.come()
    sensor.go()
    advance(sim, 20)
    sim.reset_simulation()
    sensor.come()
    assert sensor.times == [0, 0]


def test_who_comes_instead_of_one_who_has_left_unnoticed_gets_what_the_other_was_sent(sim, make):
    """rospy learns that a subscriber has gone when it sends the next time."""
    sensor = make(10.0)
    sensor.come()
    sim.reset_simulation()
    sensor.come()
    assert sensor.times == [0, 0, 0]
    advance(sim, 100)
    sensor.come()
    assert sensor.times[3:] == [100 * MS, 100 * MS]
    advance(sim, 5)
    sensor.come()  # this one waits for a measurement that is new
    assert len(sensor.times) == 5


def test_the_slowest_of_rates_is_one(sim, make):
    sensor = make(1e-320)
    sensor.come()
    advance(sim, 2)
    assert sensor.times == [0]


def test_a_clock_that_has_ended_measures_no_more(sim, make):
    sensor = make(100.0, lambda now: pytest.fail("measured"), at_once=False)
    sensor.come()
    sensor.clock.end()
    sensor.clock.end()
    sensor.clock.look(somebody_came=True)  # by a thread of rospy's that was late
    advance(sim, 20)


def test_one_that_fails_ends_and_the_world_goes_on(sim, schedule, make):
    def fail(now):
        schedule.fail(sensor.clock)

    sensor = make(100.0, fail, at_once=False)
    other = make(100.0, at_once=False)
    sensor.come()
    advance(sim, 30)
    assert sim.now == 30 * MS
    other.come()
    advance(sim, 10)
    assert other.times == [40 * MS]


def test_a_callback_that_looks_under_the_worlds_lock_does_not_wait_for_it(sim, make):
    """rospy finds a subscriber gone while a tick publishes."""
    sensor = make(100.0)
    with sim.lock:
        sensor.listeners = 1
        sensor.clock.look(somebody_came=True)
        sim.advance(10)  # looks first
    assert sensor.times == [0, 10 * MS]
    for thread in threading.enumerate():
        if thread.name == "sensors' listeners":
            thread.join(60.0)
    assert sensor.times == [0, 10 * MS]


def test_a_reset_with_a_seed_begins_the_clocks_anew(sim, make):
    """So that an episode measures at the same of its times, whenever it begins."""
    sensor = make(100.0)
    sensor.come()
    advance(sim, 13)
    with sim.lock, sim.moves.as_one():
        sim.reseed(5)
        sim.reset(everything=False)
    advance(sim, 20)
    assert sensor.times == [0, 10 * MS, 13 * MS, 23 * MS, 33 * MS]
