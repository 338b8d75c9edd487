"""What is measured of a state: noise, the steps of encoders, delay."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_envs.variation.imperfections import Sensor
from robot_envs.world_state import JointState, Motion, Pose, WorldState

JOINTS = ("elbow", "shoulder")
PERIOD = 0.01  # [s]


def state(elbow: float, shoulder: float = 0.0, rate: float = 0.0, **more) -> WorldState:
    joints = {"elbow": JointState(elbow, rate, 1.5), "shoulder": JointState(shoulder, -rate, -2.5)}
    return WorldState(0.0, joints, **more)


STATES = [state(float(index)) for index in range(6)]


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def many(sensor: Sensor, rng: np.random.Generator, of: WorldState) -> np.ndarray:
    """Of many measurements position, velocity and effort of each joint: (n, joints, 3)."""
    seen = [sensor.measure(of, rng).joints for _ in range(4000)]
    return np.array([[joints[name] for name in JOINTS] for joints in seen])


def test_without_options_the_truth_is_seen_and_nothing_is_drawn(rng):
    sensor = Sensor(JOINTS, PERIOD)
    assert sensor.is_exact
    assert [sensor.begin(STATES[0], rng), sensor.measure(STATES[1], rng)] == STATES[:2]
    assert rng.random() == np.random.default_rng(1).random()


def test_measurements_arrive_late_and_episodes_do_not_mix(rng):
    sensor = Sensor(JOINTS, PERIOD, delay=2)
    for _ in range(2):
        seen = [sensor.begin(STATES[0], rng), *(sensor.measure(each, rng) for each in STATES[1:])]
        assert seen == [STATES[0]] * 3 + STATES[1:-2]


def test_all_of_a_state_is_late_but_what_the_controllers_were_told(rng):
    sensor = Sensor(JOINTS, PERIOD, delay=1)
    tip = {"tip": Motion(Pose((1.0, 2.0, 3.0)))}
    before = state(0.0, commands={"motor": 1.0}, links=tip)
    sensor.begin(before, rng)
    seen = sensor.measure(state(5.0, commands={"motor": 2.0}), rng)
    assert (seen.joints, seen.links) == (before.joints, tip)
    assert seen.commands == {"motor": 2.0}


@pytest.mark.parametrize(
    ("noise", "sizes"),
    [
        (0.1, [[0.1, 0.1], [0.1, 0.1]]),
        ((0.1, 2.0), [[0.1, 2.0], [0.1, 2.0]]),
        ({"elbow": 0.1, "shoulder": (0.2, 2.0)}, [[0.1, 0.1], [0.2, 2.0]]),
        ({"shoulder": np.array([0.2, 2.0])}, [[0.0, 0.0], [0.2, 2.0]]),
    ],
)
def test_noise_has_the_size_asked_for(rng, noise, sizes):
    seen = many(Sensor(JOINTS, PERIOD, noise), rng, state(3.0, -1.0, 0.5))
    assert seen.std(axis=0)[:, :2] == pytest.approx(np.array(sizes), rel=0.05)
    truth = [[3.0, 0.5, 1.5], [-1.0, -0.5, -2.5]]
    assert seen.mean(axis=0) == pytest.approx(np.array(truth), abs=0.1)
    assert (seen[:, :, 2] == [1.5, -2.5]).all()  # efforts are exact


def test_the_stream_does_not_depend_on_how_much_noise_there_is(rng):
    other = np.random.default_rng(1)
    Sensor(JOINTS, PERIOD, {"elbow": 0.1}).measure(STATES[0], rng)
    Sensor(JOINTS, PERIOD, {"elbow": (0.0, 3.0), "shoulder": 1.0}).measure(STATES[0], other)
    assert rng.random() == other.random()


@given(st.floats(-100.0, 100.0), st.floats(1e-4, 1.0))
def test_an_encoder_tells_the_nearest_of_its_steps(position, step):
    sensor = Sensor(JOINTS, PERIOD, encoder_step={"elbow": step})
    seen = sensor.begin(state(position, position), np.random.default_rng(0))
    found = seen.joints["elbow"].position
    assert abs(found - position) <= step / 2 * (1 + 1e-9)
    assert found / step == pytest.approx(round(found / step), abs=1e-6)
    assert seen.joints["shoulder"].position == position


def test_an_encoders_velocity_is_the_difference_of_two_positions(rng):
    """At 0.25 rad/s a step of 0.01 rad passes every fourth control period of 10 ms."""
    sensor = Sensor(JOINTS, PERIOD, encoder_step=0.01)
    positions = [0.0025 * (step + 0.5) for step in range(9)]
    seen = [sensor.begin(state(positions[0], rate=0.25), rng)]
    seen += [sensor.measure(state(each, rate=0.25), rng) for each in positions[1:]]
    rates = [each.joints["elbow"].velocity for each in seen]
    assert rates == pytest.approx([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    sensor.begin(state(0.0, rate=0.25), rng)  # nothing is left of the episode before
    assert sensor.measure(state(0.0), rng).joints["elbow"].velocity == 0.0


def test_an_encoder_begins_with_the_velocity_that_an_episode_begins_with(rng):
    seen = Sensor(JOINTS, PERIOD, encoder_step=0.001).begin(state(1.0, rate=5.0), rng)
    assert seen.joints["elbow"].velocity == pytest.approx(5.0)
    assert seen.joints["shoulder"].velocity == pytest.approx(-5.0)


def test_noise_comes_before_the_steps(rng):
    seen = many(Sensor(JOINTS, PERIOD, 0.5, encoder_step=1.0), rng, state(0.3))
    assert set(seen[:, 0, 0]) <= {-2.0, -1.0, 0.0, 1.0, 2.0, 3.0}
    assert len(set(seen[:, 0, 0])) > 2
    assert seen[1:, 0, 1] == pytest.approx(np.diff(seen[:, 0, 0]) / PERIOD)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"noise": -0.1}, "sensor_noise must be a number >= 0, not -0.1"),
        ({"noise": float("nan")}, "sensor_noise"),
        ({"noise": [0.1, 0.2, 0.3]}, r"sensor_noise is a number or a pair \(position, velocity\)"),
        ({"noise": {"elbo": 0.1}}, r"sensor_noise: there is no joint 'elbo'; did you mean 'elbow'"),
        ({"delay": -1}, "sensor_delay must be a number of control steps from 0 to 1000, not -1"),
        ({"delay": 1.5}, "sensor_delay"),
        ({"encoder_step": -0.1}, "encoder_step must be a number >= 0"),
        ({"encoder_step": 1e-320}, "encoder_step must be 0 or at least 1e-09"),
        ({"encoder_step": {"knee": 0.1}}, "there is no joint 'knee'; there are elbow, shoulder"),
    ],
)
def test_what_can_not_be_is_refused(options, text):
    with pytest.raises(ValueError, match=text):
        Sensor(JOINTS, PERIOD, **options)
