"""examples/own_task.py is short, a regular environment, and known to the workbench."""

import runpy
import sys
from pathlib import Path
from typing import Any

import pytest
import torch
from gymnasium.utils.env_checker import check_env
from support.robots.fake_plant import cartpole_world

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
LONGEST = 40  # [lines]


@pytest.fixture
def own_task(imported) -> Any:
    return imported("own_task")


def test_it_is_short() -> None:
    assert len((EXAMPLES / "own_task.py").read_text(encoding="utf-8").splitlines()) <= LONGEST


def test_it_makes_an_environment_like_any_other(own_task: Any) -> None:
    env = own_task.make(render_mode="rgb_array")
    check_env(env, skip_render_check=True)
    env.close()


def test_the_reward_draws_towards_the_place(own_task: Any) -> None:
    env = own_task.make(place=-0.1)
    states = [env.task.start._replace(cart_position=x) for x in (-0.3, -0.1, 0.15, 0.4)]
    places = [*map(cartpole_world, states)]
    rewards = [env.task.reward(state, 0) for state in places]
    assert rewards == pytest.approx([0.6, 1.0, 0.5, 0.0])
    start, _ = env.reset(seed=0)
    after, reward, *_ = env.step(0)  # towards the place
    assert abs(start[0]) <= 0.05 and after[0] < start[0]
    assert reward == pytest.approx(1.0 - abs(float(after[0]) + 0.1) / 0.5)
    env.close()


@pytest.mark.slow
def test_it_is_a_workbench_that_knows_the_task(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> str:
        monkeypatch.setattr(sys, "argv", ["own_task.py", *words])
        with pytest.raises(SystemExit) as ended:
            runpy.run_path(str(EXAMPLES / "own_task.py"), run_name="__main__")
        assert ended.value.code == 0
        return capsys.readouterr().out

    run("train", "--algo", "reinforce", "--env-id", "StandAt-v0", "--episodes", "5",
        "--env-kwargs", "place=-0.1", "--run-dir", "mine")  # fmt: skip
    agent = torch.load(tmp_path / "mine" / "last.pt", weights_only=True)["agent"]
    assert any(weights.any() for weights in agent["policy"].values())  # they start at zero
    assert "over 2 greedy episodes" in run("eval", "mine", "--episodes", "2")
