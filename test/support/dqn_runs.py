"""Trainings in this process, and what is left of two of them compared: but for the clock, bits."""

import csv
import json
import math
import signal
from pathlib import Path
from typing import Any

import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from rl_workbench.training.dqn.run import DQNTraining
from rl_workbench.training.dqn.settings import Choice, choose
from rl_workbench.training.run.interrupt import Interrupt

CLOCKED = "charts/SPS"  # the only tag whose values depend on the wall clock
SMALL = {  # options of a training that is quick and uses everything there is to save
    "total_timesteps": 600,
    "learning_starts": 50,
    "train_frequency": 2,
    "hidden_sizes": "16,16",
    "batch_size": 16,
    "buffer_size": 300,
    "n_step": 3,
    "dueling": "false",
    "normalize_observations": "true",
    "lr_schedule": "linear",
    "eval_frequency": 150,
    "eval_episodes": 2,
    "confirm_episodes": 3,
    "checkpoint_frequency": 70,
    "log_frequency": 20,
    "end_e": 0.2,
}


def flags(options: dict[str, Any]) -> list[str]:
    """Options as the command line has them."""
    words = {"true": "--{}", "false": "--no-{}"}
    return [
        words.get(str(value), f"--{{}}={value}").format(name.replace("_", "-"))
        for name, value in options.items()
    ]


class InterruptAfter(Interrupt):
    """Ctrl-C, pressed when the training asks for the n-th time."""

    def __init__(self, asked: int) -> None:
        super().__init__()
        self._left = asked

    def requested(self) -> bool:
        self._left -= 1
        if self._left <= 0:
            self.signal = signal.SIGINT
        return super().requested()


def small(**changed: object) -> Choice:
    values = SMALL | changed
    return choose([], {name: str(value) for name, value in values.items()})


def train(folder: Path, interrupt: Interrupt | None = None, **changed: object) -> Path:
    folder.mkdir(exist_ok=True)
    DQNTraining(small(**changed), folder, interrupt or Interrupt()).run()
    return folder


def resume(folder: Path, interrupt: Interrupt | None = None) -> Path:
    DQNTraining(choose(["--resume", str(folder)], {}), folder, interrupt or Interrupt()).run()
    return folder


def summary(folder: Path) -> dict:
    return json.loads((folder / "summary.json").read_text())


def checkpoint(run: Path, name: str = "last.pt") -> dict[str, Any]:
    content = torch.load(run / name, weights_only=True)
    del content["log_bytes"]  # the CSV has numbers of steps per second
    del content["history"]["seconds"]
    return content


def rows(run: Path) -> list[tuple[str, ...]]:
    """The CSV without wall time, and without the values of what depends on it."""
    with (run / "scalars.csv").open(newline="") as file:
        return [
            (row["step"], row["tag"], "" if row["tag"] == CLOCKED else row["value"])
            for row in csv.DictReader(file)
        ]


def points(run: Path) -> dict[str, list[tuple[int, float]]]:
    """TensorBoard's scalars by tag: step and value."""
    log = EventAccumulator(str(run), size_guidance={"scalars": 0})
    log.Reload()
    return {
        tag: [(point.step, 0 if tag == CLOCKED else point.value) for point in log.Scalars(tag)]
        for tag in log.Tags()["scalars"]
    }


def assert_same(first: Any, second: Any, place: str = "") -> None:
    """Equal in every bit, through dicts, lists and tensors."""
    assert type(first) is type(second), place
    if isinstance(first, dict):
        assert list(first) == list(second), place
        for key in first:
            assert_same(first[key], second[key], f"{place}/{key}")
    elif isinstance(first, list | tuple):
        assert len(first) == len(second), place
        for index, pair in enumerate(zip(first, second, strict=True)):
            assert_same(*pair, f"{place}/{index}")
    elif isinstance(first, torch.Tensor):
        assert torch.equal(first, second), place
    else:
        assert first == second or (math.isnan(first) and math.isnan(second)), place


def assert_same_run(first: Path, second: Path) -> None:
    for name in ("last.pt", "best.pt"):
        mine, other = checkpoint(first, name), checkpoint(second, name)
        for content in (mine, other):
            del content["config"]["run"]["run_dir"]
        assert_same(mine, other, name)
    assert rows(first) == rows(second)
    assert points(first) == points(second)


def without_doubles(run: Path) -> None:
    """No step and tag comes twice, and TensorBoard shows what the CSV holds."""
    found = rows(run)
    keys = [row[:2] for row in found]
    assert len(keys) == len(set(keys))
    assert sum(len(values) for values in points(run).values()) == len(found)
