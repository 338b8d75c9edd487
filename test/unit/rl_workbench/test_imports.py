"""What commands import: a command starts fast, and whoever reads one has few files to read."""

import subprocess
import sys
from pathlib import Path

import pytest

SRC = Path(__file__).parents[3] / "src"
OURS = {path.name for path in SRC.iterdir() if path.is_dir()}
HEAVY = (
    "gymnasium",
    "numpy",
    "torch",
    "ray",
    "optuna",
    "viser",
    "trimesh",
    "matplotlib",
    "stable_baselines3",
    "pybullet",
)
COUNT = f"""
import sys
from rl_workbench.cli import main
try:
    main(sys.argv[1:])
except SystemExit:
    pass
print(*sorted(name for name in sys.modules if name.partition(".")[0] in {OURS!r}), sep="\\n")
print(*(name for name in {HEAVY!r} if name in sys.modules))
"""


def imported(*arguments: str) -> tuple[list[str], list[str]]:
    """Our modules, and heavy libraries, that a command imports."""
    command = [sys.executable, "-c", COUNT, *arguments]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    *lines, heavy = output.split("\n")[:-1]
    return [line for line in lines if line.partition(".")[0] in OURS], heavy.split()


@pytest.mark.slow
def test_a_training_imports_few_of_our_files(tmp_path: Path) -> None:
    short = ["--total-timesteps=50", "--eval-episodes=1", "--confirm-episodes=0"]
    flags = ["--algo=dqn", "--env-id=CartPole-v1", *short, f"--run-dir={tmp_path / 'run'}"]
    ours, _ = imported("train", *flags)
    assert (tmp_path / "run/summary.json").is_file()
    assert len(ours) <= 60, ours


@pytest.mark.parametrize("arguments", [["--help"], ["train", "--help"], ["train", "--algo=dqn", "--help"],
                                       ["train", "--algo=sac", "--help"]])  # fmt: skip
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    _, heavy = imported(*arguments)
    assert not heavy
