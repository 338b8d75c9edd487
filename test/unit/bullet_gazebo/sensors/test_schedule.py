"""When sensors measure (docs/contract/sensors.md 0.4)."""

import pytest

from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.sensors.schedule import Schedule

MS = 1_000_000
BALL = """<robot name="ball"><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


@pytest.fixture
def schedule(sim):
    return Schedule(sim)


def advance(sim, ticks):
    with sim.lock:
        sim.advance(ticks)


def test_measurements_come_with_the_period_and_do_not_drift(sim, schedule):
    times = []
    schedule.add(300.0, times.append).hear(True)  # every 3.333333 ms
    advance(sim, 100)
    assert times == [-(-k * 3_333_333 // MS) * MS for k in range(1, 31)]


def test_without_a_rate_every_step_is_measured(sim, schedule):
    times = []
    schedule.add(0.0, times.append).hear(True)
    advance(sim, 3)
    assert times == [MS, 2 * MS, 3 * MS]


def test_nobody_listening_costs_the_tick_nothing(sim, schedule):
    before = list(sim.listeners)
    times = []
    clock = schedule.add(100.0, times.append)
    advance(sim, 50)
    assert sim.listeners == before and not times
    clock.hear(True)
    assert sim.listeners != before
    clock.hear(False)
    assert sim.listeners == before


def test_a_late_listener_gets_a_measurement_at_once_and_changes_no_later_one(sim, schedule):
    times = []
    advance(sim, 4)
    clock = schedule.add(100.0, times.append)
    advance(sim, 13)
    clock.hear(True)
    advance(sim, 12)
    assert times == [17 * MS, 24 * MS]
    clock.hear(False)
    clock.hear(True)  # less than a period after the last measurement
    assert times == [17 * MS, 24 * MS]


def test_sensors_measure_in_the_order_in_which_they_were_added(sim, schedule):
    order = []
    second = schedule.add(100.0, lambda now: order.append("first"))
    first = schedule.add(200.0, lambda now: order.append("second"))
    first.hear(True)
    second.hear(True)
    advance(sim, 10)
    assert order == ["second", "first", "second"]


def test_resets_and_moves_measure_at_once_what_is_heard(sim, schedule):
    times = []
    with sim.lock:
        model = sim.world.spawn("ball", parse_urdf(BALL), Pose())
    schedule.add(100.0, times.append).hear(True)
    advance(sim, 15)
    sim.reset_world()
    with sim.lock:
        sim.place_model(model, Pose((0.0, 0.0, 1.0)), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    assert times == [10 * MS, 15 * MS, 15 * MS]
    sim.reset_simulation()
    advance(sim, 10)
    assert times[3:] == [0, 10 * MS]


def test_a_clock_that_has_ended_measures_no_more(sim, schedule):
    clock = schedule.add(100.0, lambda now: pytest.fail("measured"))
    clock.hear(True)
    clock.end()
    clock.hear(True)  # from a thread of rospy's that was late
    advance(sim, 20)
