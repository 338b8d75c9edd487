"""The robot moves as it did in version 0.1.0, to the bit: 20,000 observations of each environment."""

import hashlib
from typing import Any

import gymnasium
import numpy as np
import pytest

import cartpole  # noqa: F401 - registers the environments

STEPS = 20_000
# Of version 0.1.0. Whoever changes them changes what a seed gives, and says so in the changelog.
BITS = {
    "balance": ("cartpole/Balance-v0", {}, "9cd7b1bce35c8273a21492b5"),
    "noise": ("cartpole/Balance-v0", {"noise": 0.02}, "13c27b95aa744cc34af31e1b"),
    "classic": ("cartpole/Classic-v0", {}, "6b776d4954a7d5cc0085ec84"),
    "swing-up": ("cartpole/SwingUp-v0", {}, "99af3742f96ba34c710ed918"),
    "sensor": ("cartpole/Classic-v0", {"sensor_noise": 0.01, "sensor_delay": 2},
               "dbd3c3464dc7f453f5a010b3"),
    "randomisation": ("cartpole/Classic-v0",
                      {"randomisation": {"mass": 0.2, "length": 0.2, "cart_friction": 2.0,
                                         "pole_friction": 0.01}}, "839e3d15fdcea33c7e948252"),
}  # fmt: skip


def digest(env_id: str, options: dict[str, Any]) -> str:
    env, found = gymnasium.make(env_id, **options), hashlib.sha256()
    env.action_space.seed(3)
    observation, _ = env.reset(seed=5)
    for _ in range(STEPS):
        found.update(np.ascontiguousarray(observation).tobytes())
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        found.update(np.float64(reward).tobytes())
        if terminated or truncated:
            observation, _ = env.reset()
    env.close()
    return found.hexdigest()[:24]


@pytest.mark.slow
@pytest.mark.parametrize(("env_id", "options", "bits"), BITS.values(), ids=BITS.keys())
def test_the_bits_of_version_0_1_0(env_id: str, options: dict[str, Any], bits: str) -> None:
    assert digest(env_id, options) == bits
