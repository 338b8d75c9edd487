"""Sensors of a description as observations, in this process."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.scenes.seeing_rover import NAMES, SEEING, Look

from robot_envs import RobotEnv, SimulatorError, StateQuery
from robot_envs.testing import differences, rollout


@pytest.fixture(params=["bullet", "mujoco"])
def env(request: pytest.FixtureRequest) -> Iterator[RobotEnv]:
    made = RobotEnv(SEEING, Look(), request.param)
    yield made
    made.close()


def test_a_state_has_what_each_sensor_measured(env: RobotEnv) -> None:
    _, info = env.reset(seed=1)
    assert env.state is not None
    sensors = env.state.sensors
    assert info["sensors"] == sensors and list(sensors) == list(NAMES)
    assert all(each.time == 0.0 for each in sensors.values())  # fresh at the reset
    assert sensors["front_laser"].ranges.shape == (24,)
    assert sensors["front_laser"].ranges[12] == pytest.approx(0.4 - 0.22, abs=0.08)
    assert sensors["sonar"].ranges == pytest.approx([0.18], abs=0.05)
    assert (
        sensors["camera"].image.shape == (12, 16, 3) and sensors["camera"].image.dtype == np.uint8
    )
    assert sensors["deep"].depth.shape == (12, 16) and sensors["deep"].depth.dtype == np.float32
    assert np.linalg.norm(sensors["imu"].linear_acceleration) == pytest.approx(9.8, abs=0.1)
    assert sensors["old_imu"].linear_acceleration == pytest.approx([0.0] * 3)
    assert sensors["bumper"].contacts == []
    with pytest.raises(AttributeError, match="measures no image; it has ranges, intensities"):
        _ = sensors["front_laser"].image
    with pytest.raises(ValueError, match="read-only"):
        sensors["front_laser"].ranges[0] = 1.0


def test_each_measures_at_its_own_rate_from_the_reset_on(env: RobotEnv) -> None:
    for _ in range(2):  # the second episode begins between two measurements of the first one
        env.reset(seed=1)
        times: dict[str, list[float]] = {}
        for _ in range(7):
            env.step(np.ones(2, np.float32))
            assert env.state is not None
            for name, reading in env.state.sensors.items():
                times.setdefault(name, []).append(reading.time)
        assert times["front_laser"] == pytest.approx(np.arange(1, 8) * 0.02)
        assert times["sonar"] == pytest.approx(
            [0.0, 0.034, 0.034, 0.067, 0.1, 0.1, 0.134], abs=2e-3
        )


def test_seeds_repeat_noise_and_episodes_differ(env: RobotEnv) -> None:
    given = rollout(env, 200, seed=3)
    assert differences(given, rollout(env, 200, seed=3)) == ""
    assert not np.array_equal(given[0][0], env.reset()[0])
    assert any(
        each[1] > 0.0 for each in given if len(each) == 5
    )  # the bumper has touched the crate


class Wrong(Look):
    def __init__(self, *names: str) -> None:
        self.query = StateQuery(sensors=names)


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (
            ("lidar",),
            "there is no sensor 'lidar' that can be read; there are: front_laser, sonar, imu",
        ),
        (("front_lasr",), "no sensor 'front_lasr' that can be read; did you mean 'front_laser'"),
    ],
)
def test_unknown_sensors_are_told(names: tuple[str, ...], text: str) -> None:
    with pytest.raises(SimulatorError, match=text):
        RobotEnv(SEEING, Wrong(*names))


def test_an_impossible_sensor_is_told() -> None:
    wrong = replace(SEEING, urdf=str(SEEING.urdf).replace("<samples>24", "<samples>0"))
    with pytest.raises(SimulatorError, match="'front_laser' can't be simulated: .* 0 samples"):
        RobotEnv(wrong, Look())


def observed(**options: Any) -> list[np.ndarray]:
    env = RobotEnv(SEEING, Look(), **options)
    given = [env.reset(seed=5)[0]]
    given += [env.step(np.ones(2, np.float32))[0] for _ in range(20)]
    env.close()
    return given


def test_a_delay_shows_older_readings() -> None:
    exact, late = observed(), observed(sensor_delay=3)
    assert np.array_equal(late[:4], [exact[0]] * 4) and np.array_equal(late[4:], exact[1:-3])
