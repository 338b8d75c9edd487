"""The example that balances the cart-pole from pictures: a few steps of it."""

import csv
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
LIMIT = 300.0  # [s]

pytestmark = [pytest.mark.slow, pytest.mark.extras("stable_baselines3")]


def test_it_trains_and_evaluates(tmp_path: Path) -> None:
    words = ["--steps", "32", "--envs", "2", "--rollout", "16", "--evaluations", "1"]
    ended = subprocess.run(
        [sys.executable, f"{ROOT}/examples/ppo_from_pictures.py", *words, "--out", str(tmp_path)],
        env={**os.environ, "CUDA_VISIBLE_DEVICES": ""}, timeout=LIMIT, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "steps of 200: " in ended.stdout.splitlines()[-1]
    assert (tmp_path / "policy.zip").is_file()
    rows = list(csv.DictReader((tmp_path / "progress.csv").open()))
    assert rows[-1]["time/total_timesteps"] == "32"
