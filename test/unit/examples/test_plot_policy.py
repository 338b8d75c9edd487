"""examples/plot_policy.py draws policies of every kind."""

import runpy
import sys
from pathlib import Path

import pytest
from PIL import Image
from support.training import workbench_runs

import cartpole  # noqa: F401  registers cartpole/SwingUp-v0

SCRIPT = Path(__file__).resolve().parents[3] / "examples/plot_policy.py"


@pytest.mark.slow
@pytest.mark.parametrize("env_id", ["CartPole-v1", "cartpole/SwingUp-v0"])
def test_it_draws_the_plane(tmp_path: Path, env_id: str, monkeypatch: pytest.MonkeyPatch) -> None:
    run = workbench_runs.policy_gradient(tmp_path / "run", "reinforce", env_id=env_id)
    out = tmp_path / "policy.png"
    monkeypatch.setattr(sys, "argv", [str(SCRIPT), str(run), str(out)])
    runpy.run_path(str(SCRIPT), run_name="__main__")
    with Image.open(out) as picture:
        assert picture.format == "PNG"
