"""Small trainings by policy gradient, and what is compared of two of them."""

from pathlib import Path
from typing import Any

import torch
from dqn_runs import assert_same, points, rows
from learning_fakes import FakePlant

from rl_workbench.training.pg.run import Training
from rl_workbench.training.pg.settings import choose
from rl_workbench.training.pg.stage import gymnasium_stage, robot_stage
from rl_workbench.training.run.interrupt import Interrupt

CARTPOLE = {  # options of a training that is quick and uses everything there is to save
    "env_id": "CartPole-v1",
    "episodes": 13,
    "batch_episodes": 3,
    "value_epochs": 2,
    "policy_hidden": 4,
    "value_hidden": 4,
    "eval_frequency": 4,
    "eval_episodes": 2,
    "confirm_episodes": 3,
    "checkpoint_frequency": 5,
    "keep_checkpoints": 0,
    "seed": 3,
}


def train(
    folder: Path,
    interrupt: Interrupt | None = None,
    plant: FakePlant | None = None,
    **options: Any,
) -> Path:
    """Trains a robot that is a fake unless told otherwise, or in another environment."""
    folder.mkdir(parents=True, exist_ok=True)
    _run(choose([], {**({} if "env_id" in options else {"backend": "bullet"}), **options}), folder,
         interrupt, plant)  # fmt: skip
    return folder


def resume(
    folder: Path,
    interrupt: Interrupt | None = None,
    plant: FakePlant | None = None,
    **options: Any,
) -> Path:
    _run(choose([], {"resume": str(folder), **options}), folder, interrupt, plant)
    return folder


def _run(choice: Any, folder: Path, interrupt: Interrupt | None, plant: FakePlant | None) -> None:
    run = choice.run
    if run.is_robot:
        stage = robot_stage(plant or FakePlant(), run.start_noise)
    else:
        stage = gymnasium_stage(run.env_id, run.env_kwargs)
    Training(choice, folder, stage, interrupt or Interrupt()).run()


def checkpoint(run: Path, name: str = "last.pt") -> dict[str, Any]:
    """A checkpoint without what depends on the wall clock, or on the folder's name."""
    content = torch.load(run / name, weights_only=True)
    del content["log_bytes"], content["history"]["seconds"], content["config"]["run"]["run_dir"]
    return content


def assert_same_run(first: Path, second: Path) -> None:
    for name in ("last.pt", "best.pt"):
        assert_same(checkpoint(first, name), checkpoint(second, name), name)
    assert rows(first) == rows(second)
    assert points(first) == points(second)
    networks = {path.name for path in first.glob("*.pth")}
    assert networks == {path.name for path in second.glob("*.pth")}
    for name in networks:
        mine, other = (torch.load(run / name, weights_only=True) for run in (first, second))
        assert_same(mine, other, name)
