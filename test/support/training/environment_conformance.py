"""What every cart-pole environment promises: inherit, set `identifier` and `backend`."""

import warnings
from typing import Any, ClassVar

import gymnasium
import numpy as np
import pytest

import cartpole
from robot_envs.testing import check_robot_env

IDS = tuple(f"{cartpole.NAMESPACE}/{name}-v0" for name in ("Balance", "Classic", "SwingUp"))
RICH = {
    "sensor_noise": [0.001, 0.01, 0.001, 0.01],
    "sensor_delay": 2,
    "randomisation": {"mass": 0.2, "length": 0.1, "cart_friction": 0.5, "pole_friction": 0.001},
}


class EnvironmentConformance:
    """The tests. `identifier` and `backend` say what to make."""

    identifier: ClassVar[str]
    backend: ClassVar[str] = "bullet"
    steps: ClassVar[int] = 200
    deterministic: ClassVar[bool] = True
    has_velocities: ClassVar[bool] = True  # whether an episode can start with the joints moving

    def make(self, **options: Any) -> gymnasium.Env:
        return gymnasium.make(self.identifier, backend=self.backend, **options)

    @pytest.mark.slow
    def test_it_keeps_what_environments_of_robots_promise(self) -> None:
        check_robot_env(self.identifier, (self.backend,), steps=self.steps)

    @pytest.mark.slow
    def test_so_it_does_with_all_options(self) -> None:
        check_robot_env(self.identifier, (self.backend,), options=RICH, steps=self.steps)

    def gentle(self, env: gymnasium.Env, step: int) -> Any:
        """Back and forth."""
        if isinstance(env.action_space, gymnasium.spaces.Discrete):
            return step % 2
        return np.array([0.1 if step % 2 else -0.1], dtype=np.float32)

    def test_leaving_the_rail_terminates(self) -> None:
        env = self.make()
        env.reset(seed=1)
        discrete = isinstance(env.action_space, gymnasium.spaces.Discrete)
        action = 1 if discrete else np.ones(1, np.float32)
        ends = []
        while not ends or not (ends[-1][0] or ends[-1][1]):
            ends.append(env.step(action)[2:4])
        assert ends[-1] == (True, False)
        assert len(ends) < 200
        env.close()

    def test_a_control_period_of_broken_steps_is_refused_with_both_numbers(self) -> None:
        try:
            self.make(control_period=0.0085)
        except ValueError as error:
            assert "0.0085 s" in str(error)
            assert "0.001 s" in str(error)
        else:
            raise AssertionError("8.5 physics steps were accepted")

    def test_the_start_is_seeded_and_within_the_noise(self) -> None:
        env = self.make(noise=0.02).unwrapped
        starts = [env.reset(seed=7)[0], *(env.reset()[0] for _ in range(5))]
        again = [env.reset(seed=7)[0], *(env.reset()[0] for _ in range(5))]
        assert np.array_equal(starts, again)
        assert len({start.tobytes() for start in starts}) == 6
        assert max(abs(start[0]) for start in starts) <= np.float32(0.02)
        if self.has_velocities and not self.identifier.startswith("cartpole/Balance"):
            assert all(start[1] != 0.0 for start in starts)
        env.close()

    def test_a_measurement_is_late_by_the_delay(self) -> None:
        if not self.deterministic:
            return
        prompt, late = self.make(), self.make(sensor_delay=3)
        seen, told = [], []
        for env, record in ((prompt, seen), (late, told)):
            record.append(env.reset(seed=4)[0])
            record += [env.step(self.gentle(env, step))[0] for step in range(10)]
            env.close()
        assert np.array_equal(told, [seen[0]] * 3 + seen[:-3])

    def test_a_drawn_robot_is_told_and_moves_otherwise(self) -> None:
        env = self.make(randomisation=RICH["randomisation"])
        _, info = env.reset(seed=3)
        varied = env.step(self.gentle(env, 0))[0]
        assert info["variation"].shape == (5,)
        assert (info["variation"] != [1, 1, 1, 0, 0]).all()
        env.close()
        env = self.make()
        env.reset(seed=3)
        assert not np.array_equal(varied, env.step(self.gentle(env, 0))[0])
        env.close()

    def stable_baselines3_agrees(self) -> None:
        """Stable-Baselines3's checker has nothing to say; it must be installed."""
        from stable_baselines3.common.env_checker import check_env as check

        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.filterwarnings("default", module="rospy")  # of Python's renamed methods
            env = self.make()
            check(env.unwrapped)
            env.close()
