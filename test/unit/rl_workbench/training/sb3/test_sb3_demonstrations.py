"""Demonstrations begin the replay buffer; resumed to the bit; one line for those that don't fit."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from support.training import training_runs
from support.training.goal_environments import REACH
from support.training.learning_fakes import register_with
from support.training.recorded import recorded
from support.training.training_runs import InterruptAfter, assert_same_run, options_of, run, summary

from rl_workbench.training.demonstrations import Origin, load, paths

pytestmark = pytest.mark.extras("stable_baselines3")

SAC = {"env_id": REACH, "seed": 3, "her": True, "net_arch": "8", "learning_starts": 10, "batch_size": 8,
       "buffer_size": 400, "total_timesteps": 60, "eval_frequency": 0, "eval_episodes": 1,
       "checkpoint_frequency": 25, "keep_checkpoints": 0}  # fmt: skip


class Noise(gymnasium.Env):
    """A picture of noise at each step."""

    observation_space, action_space = spaces.Box(0, 255, (36, 36, 3), np.uint8), spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._steps = 0
        return self._look(), {}

    def _look(self):
        return self.np_random.integers(0, 256, (36, 36, 3), np.uint8)

    def step(self, action):
        self._steps += 1
        return self._look(), float(action), False, self._steps == 5, {}


@pytest.fixture(scope="module")
def demos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first episode is whole; not to be changed."""
    return recorded(tmp_path_factory.mktemp("demos") / "reach", REACH, (20, 7))


def sac(folder: Path, demos: Path, interrupt: Any = None, **changed: Any) -> Path:
    return run(options_of("sac", {**SAC, "demos": str(demos), **changed}), folder, interrupt)


def begun(folder: Path) -> dict[str, np.ndarray]:
    """The buffer before the first step."""
    first = min((folder / "checkpoints").iterdir())
    buffer = training_runs.checkpoint(folder, str(first.relative_to(folder)))["buffer"]
    return {name: array.numpy() for name, array in buffer["arrays"].items()}


def test_each_environment_begins_with_every_step_of_them(tmp_path: Path, demos: Path) -> None:
    arrays = begun(sac(tmp_path / "run", demos, num_envs=2))
    assert arrays["actions"].shape == (27, 2, 2)
    ends = np.flatnonzero(arrays["dones"][:, 0])
    assert ends.tolist() == [19, 26] == np.flatnonzero(arrays["timeouts"][:, 0]).tolist()
    for array in arrays.values():
        assert np.array_equal(array[:, 0], array[:, 1])
    env = Origin(REACH, {}).make()
    seen, _ = env.reset(seed=1)
    taken = load(paths(demos)[1]).actions  # the buffer has them scaled
    assert np.allclose(arrays["actions"][20:, 0], taken, atol=1e-6)
    for step, action in enumerate(taken, 20):
        assert np.array_equal(arrays["observations/achieved_goal"][step, 0], seen["achieved_goal"])
        seen, reward, *_ = env.step(action)
        assert np.array_equal(arrays["next_observations/observation"][step, 0], seen["observation"])
        assert arrays["rewards"][step, 0] == np.float32(reward)
    env.close()


def test_pictures_and_choices_begin_it_too(tmp_path: Path, monkeypatch) -> None:
    env_id = register_with(monkeypatch, Noise)
    demos = recorded(tmp_path / "demos", env_id, (5, 3))
    small = {"env_id": env_id, "net_arch": "8", "buffer_size": 20, "learning_starts": 9, "demos": str(demos),
             "total_timesteps": 4, "eval_frequency": 0, "eval_episodes": 1}  # fmt: skip
    arrays = begun(run(options_of("dqn-sb3", small), tmp_path / "run"))
    before, after = arrays["observations"][:, 0], arrays["next_observations"][:, 0]
    follows = [np.array_equal(*pair) for pair in zip(after[:-1], before[1:], strict=True)]
    assert follows == [True] * 4 + [False] + [True] * 2
    env = Origin(env_id, {}).make()
    assert np.array_equal(before[5].transpose(1, 2, 0), env.reset(seed=1)[0])
    assert np.array_equal(arrays["rewards"], arrays["actions"][..., 0])


def test_a_resumed_training_needs_them_no_more(tmp_path: Path) -> None:
    demos = recorded(tmp_path / "demos", REACH, (20, 7))
    counting = InterruptAfter()
    whole = sac(tmp_path / "whole", demos, counting)
    runs = [sac(tmp_path / str(at), demos, InterruptAfter(at)) for at in (1, counting.times // 2)]
    demos.rename(tmp_path / "elsewhere")
    for each in runs:
        assert summary(each)["interrupted"] and summary(each)["steps"] < 60
        assert_same_run(whole, training_runs.resume(each))


def test_those_that_do_not_fit_are_one_line(tmp_path: Path, demos: Path) -> None:
    def told(folder: Path, **changed: Any) -> str:
        return training_runs.failure(lambda: sac(tmp_path / "run", folder, **changed))

    assert "reach has 27 steps, but the replay buffer holds 20" in told(demos, buffer_size=20)
    assert "has no demonstrations" in told(tmp_path)
    other = {"env_id": "Pendulum-v1", "her": False}
    assert f"reach is of {REACH}, not of Pendulum-v1" in told(demos, **other)
    assert "reach has the observation_space Dict" in told(demos, env_kwargs={"joints": 3})
    choices = recorded(tmp_path / "choices", REACH, (3,), moves=4)
    assert "choices has the action_space Discrete(4)" in told(choices)
    torn = tmp_path / "torn"
    torn.mkdir()
    for path in demos.iterdir():
        (torn / path.name).write_bytes(path.read_bytes()[:-40])
    assert "isn't a demonstration, or it is damaged" in told(torn)
