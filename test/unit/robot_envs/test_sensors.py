"""Sensors of a description as observations, in this process."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from support.scenes.seeing_rover import NAMES, SEEING, Look

from robot_envs import RobotEnv, SimulatorError, WorldState
from robot_envs.testing import differences, rollout

WALLS = """<sdf version="1.6"><world name="walls"><model name="wall"><static>true</static><link name="wall">
<collision name="c"><pose>2 0 0.5 0 0 0</pose><geometry><box><size>0.1 4 1</size></box></geometry></collision>
</link></model></world></sdf>"""


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
    image, depth = sensors["camera"].image, sensors["deep"].depth
    assert (image.shape, image.dtype) == ((12, 16, 3), np.uint8)
    assert (depth.shape, depth.dtype) == ((12, 16), np.float32)
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
            env.backend.look(Look.query)  # asking for the same again begins nothing anew
            env.step(np.ones(2, np.float32))
            assert env.state is not None
            for name, reading in env.state.sensors.items():
                times.setdefault(name, []).append(reading.time)
        assert times["front_laser"] == pytest.approx(np.arange(1, 8) * 0.02)
        at_30_hz = [0.0, 0.034, 0.034, 0.067, 0.1, 0.1, 0.134]
        assert times["sonar"] == pytest.approx(at_30_hz, abs=2e-3)


def test_seeds_repeat_noise_and_episodes_differ(env: RobotEnv) -> None:
    given = rollout(env, 200, seed=3)
    assert differences(given, rollout(env, 200, seed=3)) == ""
    assert not np.array_equal(given[0][0], env.reset()[0])
    assert any(each[1] > 0.0 for each in given if len(each) == 5)  # the bumper has touched it


def test_an_impossible_sensor_is_told() -> None:
    wrong = replace(SEEING, urdf=str(SEEING.urdf).replace("<samples>24", "<samples>0"))
    with pytest.raises(SimulatorError, match="'front_laser' can't be simulated: .* 0 samples"):
        RobotEnv(wrong, Look())


def test_worlds_of_a_process_share_what_never_moves() -> None:
    """Also after one of them is gone, and with the same bits."""
    tasks = Look(), Look()
    envs = [RobotEnv(replace(SEEING, world=WALLS), task) for task in tasks]
    given = [env.reset(seed=5)[0] for env in envs]
    assert np.array_equal(*given)
    first, second = (env.backend._sensing.collisions._still_triangles for env in envs)
    assert first is second
    envs[0].close()
    assert np.array_equal(envs[1].reset(seed=5)[0], given[0])
    envs[1].close()


def test_noise_is_added_once_to_each_measurement() -> None:
    """To those of sensors that the option names, by number or by attribute."""
    noise = {"sonar": 0.1, "camera": 20, "imu": {"angular_velocity": 0.5}}
    kept: list[WorldState] = []

    class Keep(Look):
        def observe(self, state: WorldState) -> np.ndarray:
            kept.append(state)
            return super().observe(state)

    env = RobotEnv(SEEING, Keep(), sensor_noise=noise)
    env.reset(seed=5)
    for _ in range(2):  # the sonar's measurement is that of the reset after the first
        seen, true = kept[-1].sensors, env.state.sensors if env.state else {}
        assert {name for name in NAMES if seen[name] != true[name]} == set(noise)
        assert seen["imu"].linear_acceleration is true["imu"].linear_acceleration
        assert seen["camera"].image.dtype == np.uint8
        env.step(np.ones(2, np.float32))
    assert kept[0].sensors["sonar"] == kept[1].sensors["sonar"]
    assert kept[0].sensors["camera"] != kept[1].sensors["camera"]
    env.close()
    with pytest.raises(ValueError, match="no joint 'sonnar'"):
        RobotEnv(SEEING, Look(), sensor_noise={"sonnar": 0.1})
    with pytest.raises(ValueError, match="no attribute of a reading 'range'.*ranges"):
        RobotEnv(SEEING, Look(), sensor_noise={"sonar": {"range": 0.1}})
