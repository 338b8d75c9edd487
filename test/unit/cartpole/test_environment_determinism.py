"""The same seed and actions give the same bits: over many steps, across resets, processes and vectors."""

import hashlib
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.training.environment_conformance import IDS, RICH

import cartpole  # noqa: F401 - registers the environments
from robot_envs.testing import differences, rollout

STEPS = {"plain": 10_000, "rich": 2_000}
OPTIONS = {"max_steps": 150}


def digest(given):
    """Of all observations, rewards and flags."""
    sums = hashlib.sha256()
    for row in given:
        sums.update(row[0].tobytes())
        sums.update(repr(row[1:4] if len(row) == 5 else ()).encode())
    return sums.hexdigest()


def long_run(identifier, kind="plain"):
    env = gymnasium.make(identifier, **OPTIONS, **(RICH if kind == "rich" else {}))
    given = rollout(env, STEPS[kind], seed=11)
    env.close()
    return digest(given)


@pytest.mark.parametrize("kind", STEPS)
@pytest.mark.parametrize("identifier", IDS)
def test_ten_thousand_steps_twice_and_in_another_process(identifier, kind):
    first = long_run(identifier, kind)
    assert long_run(identifier, kind) == first
    script = f"import test_environment_determinism as t;print(t.long_run({identifier!r}, {kind!r}))"
    path = ":".join([str(Path(__file__).parent), *(entry for entry in sys.path if entry)])
    shown = subprocess.run(
        [sys.executable, "-c", script],
        env={"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert shown.stdout.split()[-1:] == [first], shown.stderr


@pytest.mark.parametrize("options", [{}, RICH], ids=["plain", "rich"])
@pytest.mark.parametrize("identifier", IDS)
def test_a_late_episode_is_the_one_of_a_fresh_environment(identifier, options):
    used, fresh = (gymnasium.make(identifier, **OPTIONS, **options) for _ in range(2))
    for seed in range(20):
        rollout(used, 50, seed)
    late, first = rollout(used, 400, seed=99), rollout(fresh, 400, seed=99)
    assert differences(late, first) == ""
    used.close()
    fresh.close()


def test_different_seeds_are_different_episodes():
    env = gymnasium.make("cartpole/Classic-v0")
    assert len({env.reset(seed=seed)[0].tobytes() for seed in range(100)}) == 100
    env.close()


def test_the_seed_alone_decides_not_pythons_nor_numpys_random_numbers():
    first = long_run("cartpole/Classic-v0")
    np.random.seed(5)
    assert long_run("cartpole/Classic-v0") == first
