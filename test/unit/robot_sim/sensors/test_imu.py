"""What IMUs feel (docs/contract/sensors.md 3), and hector's errors (12.1)."""

import math

import numpy as np
import pytest

from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.sensors.drift import DriftingError
from robot_sim.sensors.imu import Imu, motion_of, with_noise
from robot_sim.sensors.noise import generator

MS = 1_000_000
G = 9.8


def felt(world, model, feels_gravity=True, offset=Pose(), steps=10):  # noqa: B008 - a Pose is a tuple
    """What an IMU at `offset` measures after `steps` of 1 ms; the world is stepped."""
    imu = Imu(feels_gravity)
    imu.measure(0, 0, motion_of(model, "link", offset), world.gravity)
    for _ in range(steps):
        world.step()
    return imu.measure(steps * MS, 0, motion_of(model, "link", offset), world.gravity)


@pytest.mark.parametrize("feels_gravity", [True, False])
def test_at_rest_and_tilted_without_and_with_noise(world, put, feels_gravity):
    pose = Pose((0.0, 0.0, 3.0), from_rpy(0.0, math.radians(30.0), 0.0))
    box = put("box", "box", (1.0, 1.0, 1.0), pose)
    sample = felt(world, box, feels_gravity)
    expected = np.array([-math.sin(math.radians(30.0)), 0.0, math.cos(math.radians(30.0))])
    np.testing.assert_allclose(sample.linear_acceleration, feels_gravity * G * expected, atol=1e-9)
    assert sample.orientation == pytest.approx(pose.orientation)
    noisy = with_noise(sample, 0.1, generator(0))
    assert math.hypot(*noisy.orientation) == pytest.approx(1.0)
    assert noisy.linear_acceleration != sample.linear_acceleration
    assert with_noise(sample, 0.0, generator(0)) == sample


def test_falling_feels_nothing(world, put):
    box = put("box", "box", (1.0, 1.0, 1.0), Pose((0.0, 0.0, 50.0)), static=False)
    np.testing.assert_allclose(felt(world, box).linear_acceleration, 0.0, atol=1e-6)
    older = felt(world, box, feels_gravity=False).linear_acceleration
    np.testing.assert_allclose(older, [0.0, 0.0, -G], atol=1e-6)


def test_off_a_spinning_axis_it_is_drawn_inwards(world, put):
    ball = put("ball", "sphere", (0.5,), Pose((0.0, 0.0, 50.0)), static=False)
    ball.place(Pose((0.0, 0.0, 50.0)), ((0.0, 0.0, 0.0), (0.0, 0.0, 2.0)))
    sample = felt(world, ball, offset=Pose((1.0, 0.0, 0.0)), steps=2)
    np.testing.assert_allclose(sample.linear_acceleration, [-4.0, 0.0, 0.0], atol=0.02)
    np.testing.assert_allclose(sample.angular_velocity, [0.0, 0.0, 2.0], atol=1e-3)


def test_across_a_move_there_is_no_acceleration(world, put):
    box = put("box", "box", (1.0, 1.0, 1.0), Pose((0.0, 0.0, 50.0)), static=False)
    imu = Imu(feels_gravity=True)
    assert imu.measure(0, 0, motion_of(box, "link"), world.gravity) is None
    box.place(Pose(), ((5.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    sample = imu.measure(MS, 1, motion_of(box, "link"), world.gravity)
    assert sample.linear_acceleration == pytest.approx((0.0, 0.0, G))


def error(**given):
    return DriftingError(lambda tag, default: np.full(3, given.get(tag, default)), "accel")


def test_hectors_errors_have_scale_offset_noise_and_a_drift_that_stays_bounded():
    exact = error(accelOffset=0.5, accelScaleError=2.0).applied(np.ones(3), 0.01, generator(0))
    assert exact.tolist() == [2.5] * 3
    noisy = error(gaussianNoise=0.1)
    draws = [noisy.applied(np.zeros(3), 0.01, generator(0, index)) for index in range(2000)]
    assert np.std(draws) == pytest.approx(0.1, rel=0.05)
    drifting = error(accelDrift=0.2, accelDriftFrequency=1.0)
    walk = [drifting.applied(np.zeros(3), 0.01, generator(1, index)) for index in range(2000)]
    assert 0.0 < np.abs(walk).max() < 1.0
    drifting.restart()
    assert drifting.bias.tolist() == [0.0] * 3
