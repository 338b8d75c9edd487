"""The robot moves as it did in version 0.1.0, to the bit: 4,000 observations of each environment."""

import hashlib
from typing import Any

import gymnasium
import numpy as np
import pytest

import cartpole  # noqa: F401 - registers the environments

STEPS = 4_000
# Of version 0.1.0, but for lengths. To change them changes what a seed gives, and says it in the changelog.
BITS = {
    "balance": ("cartpole/Balance-v0", {}, "0018f7dc2daa5258b39742be"),
    "noise": ("cartpole/Balance-v0", {"noise": 0.02}, "8ac6078a30296827ff84085b"),
    "classic": ("cartpole/Classic-v0", {}, "02c62be2c60b2d444e452f9e"),
    "swing-up": ("cartpole/SwingUp-v0", {}, "5de5fc84c24a0f91348ef46f"),
    "sensor": ("cartpole/Classic-v0", {"sensor_noise": 0.01, "sensor_delay": 2},
               "a0e7f86bfe4fde7e8bb12fe3"),
    "randomisation": ("cartpole/Classic-v0",
                      {"randomisation": {"mass": 0.2, "length": 0.2, "cart_friction": 2.0,
                                         "pole_friction": 0.01}}, "bb3f306380aa9d844cacd4a2"),
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
