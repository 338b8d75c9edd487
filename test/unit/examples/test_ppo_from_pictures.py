"""The example that balances the cart-pole from pictures: a few steps of it."""

import csv
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.extras("stable_baselines3")]


def test_it_trains_and_evaluates(printed, tmp_path: Path) -> None:
    words = ["--steps", "32", "--envs", "2", "--rollout", "16", "--evaluations", "1"]
    told = printed("ppo_from_pictures.py", *words, "--out", tmp_path, CUDA_VISIBLE_DEVICES="")
    assert "steps of 200: " in told.splitlines()[-1]
    assert (tmp_path / "policy.zip").is_file()
    rows = list(csv.DictReader((tmp_path / "progress.csv").open()))
    assert rows[-1]["time/total_timesteps"] == "32"
