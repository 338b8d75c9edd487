"""examples/rllib_ppo.py configures RLlib for the cart-pole; RLlib is a stand-in."""

import sys
from unittest.mock import MagicMock

import pytest

RLLIB = ("ray", "ray.rllib", "ray.rllib.algorithms", "ray.rllib.algorithms.ppo", "ray.tune",
         "ray.tune.registry")  # fmt: skip


def test_workers_make_the_cart_pole(imported, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in RLLIB:
        monkeypatch.setitem(sys.modules, name, MagicMock())
    monkeypatch.setattr(sys, "argv", ["rllib_ppo.py", "--iterations", "0"])
    example = imported("rllib_ppo")
    example.main()
    name, make_env = example.register_env.call_args.args
    (chosen,), options = example.PPOConfig().environment.call_args
    assert chosen == name
    env = make_env(options["env_config"])
    env.reset(seed=0)
    assert env.step(env.action_space.sample())[1] == 1.0
    env.close()
