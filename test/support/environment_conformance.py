"""What every environment of this package promises: inherit, override `options`, and it is tested.

As dm_env's mixin: the same tests for each backend, and for each task.
"""

import contextlib
import copy
import pickle
import warnings
from collections.abc import Iterator
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.env_checker import data_equivalence as same

from cartpole import registration

IDS = tuple(f"{registration.NAMESPACE}/{name}-v{registration.VERSION}" for name in registration.IDS)
RICH = {
    "sensor_noise": [0.001, 0.01, 0.001, 0.01],
    "sensor_delay": 2,
    "randomisation": {"mass": 0.2, "length": 0.1, "cart_friction": 0.5, "pole_friction": 0.001},
}


def rollout(env: gymnasium.Env, steps: int, seed: int) -> list[tuple]:
    """All that an environment gives for seeded random actions; episodes follow one another."""
    env.action_space.seed(seed)
    given: list[tuple] = [env.reset(seed=seed)]
    for _ in range(steps):
        given.append(env.step(env.action_space.sample()))
        if given[-1][2] or given[-1][3]:
            given.append(env.reset())
    return given


@contextlib.contextmanager
def no_warnings() -> Iterator[None]:
    """Nothing in it may warn; rospy alone does, of Python's renamed methods, in threads of its own."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    ours = [str(warning.message) for warning in caught if "/rospy/" not in warning.filename]
    assert ours == []


class EnvironmentConformance:
    """The tests. `identifier` and `options` say what to make."""

    identifier: ClassVar[str]
    options: ClassVar[dict[str, Any]] = {}
    deterministic: ClassVar[bool] = True
    has_velocities: ClassVar[bool] = True  # whether an episode can start with the joints moving
    steps: ClassVar[int] = 200

    def make(self, **options: Any) -> gymnasium.Env:
        return gymnasium.make(self.identifier, **{**self.options, **options})

    def test_gymnasiums_checker_has_nothing_to_say(self) -> None:
        with no_warnings():
            env = self.make()
            check_env(env.unwrapped)
            env.close()

    def test_its_checker_has_nothing_to_say_with_all_options(self) -> None:
        with no_warnings():
            env = self.make(**RICH)
            check_env(env.unwrapped)
            env.close()

    def test_observations_lie_in_their_space_and_flags_are_plain(self) -> None:
        env = self.make(max_steps=50)
        for given in rollout(env, self.steps, seed=1):
            assert given[0] in env.observation_space
            if len(given) == 5:
                assert type(given[1]) is float
                assert type(given[2]) is bool
                assert type(given[3]) is bool
        env.close()

    def test_an_episode_is_cut_off_and_not_terminated(self) -> None:
        env = self.make(max_steps=5)
        for _ in range(2):
            env.reset(seed=1)
            ends = [env.step(self.gentle(env, step))[2:4] for step in range(5)]
            assert ends == [(False, False)] * 4 + [(False, True)]
        env.close()

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

    def test_a_step_needs_an_episode(self) -> None:
        env = self.make(max_steps=1).unwrapped
        action = env.action_space.sample()
        for _ in range(2):
            try:
                env.step(action)
            except gymnasium.error.ResetNeeded:
                env.reset()
                env.step(action)
            else:
                raise AssertionError("a step without an episode was carried out")
        env.close()

    def test_wrong_actions_are_refused_and_move_nothing(self) -> None:
        env = self.make().unwrapped
        env.reset(seed=1)
        nan = float("nan")
        wrong: list[Any] = [nan, None, "1", np.zeros(2), np.zeros((1, 1))]
        if isinstance(env.action_space, gymnasium.spaces.Discrete):
            wrong += [2, -1, np.int64(2), np.array([1])]
        else:
            wrong += [0.5, np.float32(0.5), np.array([1.5]), np.array([nan])]
        for action in wrong:
            try:
                env.step(action)
            except ValueError as error:
                assert "an action" in str(error)
            else:
                raise AssertionError(f"{action} was carried out")
        env.step(self.gentle(env, 0))
        env.close()

    def test_a_closed_environment_says_so(self) -> None:
        env = self.make().unwrapped
        env.reset(seed=1)
        env.close()
        env.close()
        for call in (env.reset, lambda: env.step(self.gentle(env, 0))):
            try:
                call()
            except gymnasium.error.ClosedEnvironmentError as error:
                assert "make another one" in str(error)
            else:
                raise AssertionError("a closed environment went on")

    def test_what_it_was_made_of_can_be_copied_sent_and_made_again(self) -> None:
        env = self.make(max_steps=7, sensor_noise=[0.1, 0.0, 0.1, 0.0])
        first = env.reset(seed=1)[0]
        spec = pickle.loads(pickle.dumps(copy.deepcopy(env.spec)))
        env.close()
        again = gymnasium.make(spec)
        assert np.array_equal(again.reset(seed=1)[0], first)
        again.close()

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

    def test_the_same_seed_and_actions_give_the_same_bits(self) -> None:
        if not self.deterministic:
            return
        env = self.make(max_steps=60, **RICH)
        first, again = (rollout(env, self.steps, seed=5) for _ in range(2))
        env.close()
        assert all(same(a, b, exact=True) for a, b in zip(first, again, strict=True))

    def test_a_picture_shows_the_robot(self) -> None:
        env = self.make(render_mode="rgb_array")
        env.reset(seed=1)
        before = env.render()
        for step in range(4):
            env.step(self.gentle(env, step))
        after = env.render()
        assert before.shape == after.shape == (320, 640, 3)
        assert before.dtype == np.uint8
        assert not np.array_equal(before, after)
        env.close()

    def stable_baselines3_agrees(self) -> None:
        """Stable-Baselines3's checker has nothing to say; it must be installed."""
        from stable_baselines3.common.env_checker import check_env as check

        with no_warnings():
            env = self.make()
            check(env.unwrapped)
            env.close()
