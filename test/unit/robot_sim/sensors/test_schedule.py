"""When sensors measure (docs/contract/sensors.md 0.4), and whose their noise is."""

import threading
from types import SimpleNamespace

import pytest
from support.robots.snippets import link, robot
from support.robots.worlds import advance

from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.model import AT_REST
from robot_sim.physics.pose import Pose
from robot_sim.sensors.schedule import Schedule
from robot_sim.sensors.sensing import Sensing
from robot_sim.simulator import Simulator

MS = 1_000_000
BALL = robot(link("b"))


class Sensor:
    """A sensor with listeners, and the times of its measurements."""

    def __init__(self, sim, schedule, model, rate, measure=None, **options):
        self._sim, self._schedule = sim, schedule
        self.times = []
        self.listeners = 0
        measure = measure or self.times.append
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
    return sim.world.spawn(name, parse_urdf(BALL), Pose())


@pytest.fixture
def model(sim):
    return spawn(sim, "ball")


@pytest.fixture
def make(sim, schedule, model):
    """Makes a sensor that the ball carries, or another model `on`."""
    return lambda *args, on=model, **options: Sensor(sim, schedule, on, *args, **options)


def reseed(sim):
    with sim.moves.as_one():
        sim.reseed(5)
        sim.reset(everything=False)


def reset_and_place(sim):
    """In one request."""
    with sim.moves.as_one():
        sim.reset(everything=False)
        sim.place_model(sim.world.models["ball"], Pose((0.0, 0.0, 1.0)), AT_REST)


COME, GO, DUE = Sensor.come, Sensor.go, {"at_once": False}
PERIODS = [0, *(-(-k * 3_333_333 // MS) for k in range(1, 31))]
COURSES = {  # the sensor's rate, since when [ms], what happens or how many ticks pass, and when it measures
    "with the period, without a drift": (300.0, {}, [COME, 100], PERIODS),
    "without a rate in each step": (0.0, {}, [COME, 3], [0, 1, 2, 3]),
    "the slowest of rates is one": (1e-320, {}, [COME, 2], [0]),
    "a newcomer gets one at once, if the last is a period old, and changes no later one": (
        100.0, {"since": 4}, [13, COME, 12, COME, 5, GO, GO, 20, COME], [17, 24, 34, 54],
    ),
    "one that compares measurements begins when it is due": (100.0, DUE, [13, COME, 10], [20]),
    "who comes after a reset gets what there is now": (
        10.0, {}, [COME, GO, 20, Simulator.reset_simulation, COME], [0, 0],
    ),
    # rospy learns that a subscriber has gone when it sends the next time; the last one waits for a new one
    "who comes instead of one who has left unnoticed gets what the other was sent": (
        10.0, {}, [COME, Simulator.reset_simulation, COME, 100, COME, 5, COME], [0, 0, 0, 100, 100],
    ),
    "several moves of one request measure once": (100.0, DUE, [COME, reset_and_place], [0]),
    # An episode measures at the same of its times, whenever it begins.
    "a reset with a seed begins the clocks anew": (
        100.0, {}, [COME, 13, reseed, 20], [0, 10, 13, 23, 33],
    ),
}  # fmt: skip


@pytest.mark.parametrize("course", COURSES)
def test_it_measures_when(sim, make, course):
    rate, options, events, wanted = COURSES[course]
    if "since" in options:
        advance(sim, options["since"])
    sensor = make(rate, at_once=options.get("at_once", True))
    for event in events:
        if isinstance(event, int):
            advance(sim, event)
        else:
            event(sensor if event in (COME, GO) else sim)
    assert sensor.times == [each * MS for each in wanted]


def test_nobody_listening_costs_the_tick_nothing(sim, make):
    before = list(sim.listeners)
    sensor = make(100.0)
    advance(sim, 50)
    assert sim.listeners == before and not sensor.times
    sensor.come()
    assert sim.listeners != before
    sensor.go()
    assert sim.listeners == before


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
        sim.place_model(obstacle, Pose((5.0, 0.0, 1.0)), AT_REST)
    assert own.times == far.times == [n * 200 * MS for n in range(6)]
    assert len(other.times) == 16
    assert schedule.last_move(model).number == 0 < schedule.last_move(obstacle).number
    sim.world.attach((obstacle, "b"), (attached, "b"))
    sim.place_link(obstacle, "b", Pose((5.0, 0.0, 1.0)), AT_REST)
    assert (len(own.times), len(other.times), len(far.times)) == (6, 17, 7)


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


def draws(sensing, key="base::eye", now=5):
    model = SimpleNamespace(name="bot")
    return sensing.noise(model, key, now).normal(size=3).tolist()


def test_noise_is_that_of_seed_sensor_and_time_and_resets_draw_another(sim):
    first, other = Sensing(sim, 1), Sensing(sim, 2)
    assert draws(first) == draws(Sensing(sim, 1)) == draws(first)
    assert draws(first) != draws(other)
    assert draws(first) != draws(first, "base::ear") and draws(first) != draws(first, now=6)
    sim.reseed(7)
    before = draws(first)
    sim.reset_simulation()
    assert draws(first) != before
    sim.reseed(7)
    assert draws(first) == before
