"""examples/dqn_from_saved_states.py saves a demonstration, and begins episodes in it."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from cartpole.tasks import CartPoleState
from rl_workbench import cli

ID = "SwingUpDiscrete-v0"


@pytest.fixture
def example(imported, monkeypatch: pytest.MonkeyPatch) -> Any:
    made = imported("dqn_from_saved_states")
    monkeypatch.setattr(made, "DEMONSTRATED", 12)
    monkeypatch.setattr(made, "PLANS", 4)
    gymnasium.register(ID, entry_point=made.make)
    yield made
    del gymnasium.registry[ID]


@pytest.mark.slow
def test_it_trains_from_places_of_a_demonstration(example: Any, tmp_path, monkeypatch) -> None:
    places = tmp_path / "places"
    example.demonstrate(places)
    assert len(list(places.glob("*.snapshot"))) == 12
    env = example.make(places=str(places))
    angles = set()
    for seed in range(30):
        env.reset(seed=seed)
        angles.add(round(CartPoleState.of(env.state).pole_angle, 6))
    assert 12 <= len(angles) < 30  # the hanging ones differ, those of the places recur
    seen, reward, *_ = env.step(2)
    assert reward == 0.0 and np.isfinite(seen).all()
    env.close()
    monkeypatch.chdir(tmp_path)
    words = ["train", "--algo", "dqn", "--env-id", ID, "--train-env-kwargs", f"places={places}"]
    short = ["--total-timesteps", "60", "--eval-episodes", "1", "--confirm-episodes", "1"]
    assert cli.main([*words, *short, "--run-dir", "run"]) == 0
    assert (tmp_path / "run" / "best.pt").exists()
