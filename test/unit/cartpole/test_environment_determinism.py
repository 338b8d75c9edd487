"""The same seed and actions are bit-identical in another process, over many steps and resets."""

import hashlib
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.training.environment_conformance import RICH

import cartpole  # noqa: F401 - registers the environments
from robot_envs.testing import rollout

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


@pytest.mark.parametrize(
    ("identifier", "kind"), [("cartpole/SwingUp-v0", "plain"), ("cartpole/Balance-v0", "rich")]
)
def test_many_steps_in_another_process_whatever_numpys_seed(identifier, kind):
    np.random.seed(5)
    first = long_run(identifier, kind)
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
