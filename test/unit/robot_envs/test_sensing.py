"""Noise and delay of what is measured."""

import numpy as np
import pytest

from robot_envs.sensing import Sensor
from robot_envs.world_state import JointState, WorldState

HINGE = ("hinge",)
STATES = [WorldState(0.0, {"hinge": JointState(float(index), 0.0, 0.0)}) for index in range(6)]


def seen_often(sensor: Sensor) -> np.ndarray:
    """What is measured of the same state again and again: (4000, 2)."""
    rng = np.random.default_rng(1)
    return np.array([sensor.measure(STATES[3], rng).joints["hinge"][:2] for _ in range(4000)])


def test_without_noise_and_delay_the_truth_is_seen():
    rng = np.random.default_rng(0)
    sensor = Sensor(HINGE)
    assert [sensor.begin(STATES[0], rng), sensor.measure(STATES[1], rng)] == STATES[:2]
    assert rng.random() == np.random.default_rng(0).random()  # nothing was drawn


def test_measurements_arrive_late_and_episodes_do_not_mix():
    sensor, rng = Sensor(HINGE, delay=2), np.random.default_rng(0)
    for _ in range(2):
        seen = [sensor.begin(STATES[0], rng), *(sensor.measure(state, rng) for state in STATES[1:])]
        assert seen == [STATES[0]] * 3 + STATES[1:-2]


def test_one_number_goes_for_all_and_exact_is_neither_noisy_nor_late():
    seen = seen_often(Sensor(HINGE, 0.1))
    assert seen.std(axis=0) == pytest.approx([0.1, 0.1], rel=0.05)
    assert Sensor(HINGE).is_exact
    assert not Sensor(HINGE, {"hinge": (0.0, 0.1)}).is_exact
    assert not Sensor(HINGE, delay=1).is_exact


def test_noise_has_the_size_asked_for_in_each_number():
    seen = seen_often(Sensor(HINGE, noise={"hinge": (0.1, 2.0)}))
    assert seen.std(axis=0) == pytest.approx([0.1, 2.0], rel=0.05)
    assert seen.mean(axis=0) == pytest.approx([3.0, 0.0], abs=0.1)


@pytest.mark.parametrize(
    "noise", [-0.1, float("nan"), float("inf"), {"hinge": (0.1, -0.2)}, {"hing": (0.1, 0.1)}]
)
def test_impossible_noise_is_refused(noise):
    with pytest.raises(ValueError, match="sensor noise"):
        Sensor(HINGE, noise=noise)


@pytest.mark.parametrize("delay", [-1, 1001, 1.5, float("nan")])
def test_impossible_delays_are_refused(delay):
    with pytest.raises(ValueError, match="sensor delay"):
        Sensor(HINGE, delay=delay)
