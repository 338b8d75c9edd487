"""Small in-process trainings, and comparisons of two: bit-identical except for the clock."""

import csv
import json
import math
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
import torch
from support.training.learning_fakes import POLE
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.training import options as training_options
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.options import TrainingOptions, known_options, recorded_kind
from rl_workbench.training.train import choose
from rl_workbench.training.training import Training

EXACT = ("dqn", "reinforce", "reinforce-document")  # our own; they need no extras
OTHERS = [pytest.param(name, marks=pytest.mark.extras("stable_baselines3")) for name in ("ppo", "sac")]
ALL = [*EXACT, *OTHERS]

CLOCKED = "charts/SPS"  # the only tag whose values depend on the wall clock
_EVERYWHERE = {"eval_episodes": 2, "confirm_episodes": 3, "seed": 3}
# Options of trainings that are quick and use everything there is to save.
SMALL: dict[str, dict[str, Any]] = {
    "dqn": _EVERYWHERE | {
        "total_timesteps": 400, "learning_starts": 50, "train_frequency": 2, "hidden_sizes": "16,16",
        "batch_size": 16, "buffer_size": 200, "n_step": 3, "normalize_observations": "true",
        "lr_schedule": "linear", "eval_frequency": 150, "checkpoint_frequency": 70,
        "log_frequency": 20, "end_e": 0.2,
    },
    "reinforce": _EVERYWHERE | {
        "episodes": 13,  # four batches and one more
        "batch_episodes": 3, "value_epochs": 2, "policy_hidden": 4, "value_hidden": 4,
        "eval_frequency": 90, "checkpoint_frequency": 60, "save_every": 5,
    },
    "reinforce-document": _EVERYWHERE | {
        "env_id": POLE, "env_kwargs": {"noise": 0.05}, "episodes": 13, "eval_frequency": 90,
        "checkpoint_frequency": 60, "save_every": 5,
    },
    "ppo": _EVERYWHERE | {
        "total_timesteps": 256, "n_steps": 64, "batch_size": 64, "log_frequency": 64, "net_arch": "8",
        "eval_frequency": 100, "checkpoint_frequency": 70,
    },
    "sac": _EVERYWHERE | {
        "env_id": "Pendulum-v1", "env_kwargs": {"max_episode_steps": 20}, "total_timesteps": 140,
        "learning_starts": 20, "buffer_size": 60, "batch_size": 8, "net_arch": "8",
        "eval_frequency": 60, "checkpoint_frequency": 30, "log_frequency": 20,
    },
}  # fmt: skip


def flags(options: dict[str, Any]) -> list[str]:
    """Options as the command line has them."""
    words = {"true": "--{}", "false": "--no-{}"}
    return [
        words.get(str(value).lower(), f"--{{}}={value}").format(name.replace("_", "-"))
        for name, value in options.items()
    ]


class InterruptAfter(Interrupt):
    """Ctrl-C, pressed when the training asks for the n-th time; None: never."""

    def __init__(self, asked: int | None = None) -> None:
        super().__init__()
        self.times, self._asked = 0, asked

    def requested(self) -> bool:
        self.times += 1
        if self._asked is not None and self.times >= self._asked:
            self.signal = signal.SIGINT
        return super().requested()


def options_of(name: str, values: dict[str, Any]) -> TrainingOptions:
    """What isn't named, or None, keeps the algorithm's default; no file is read."""
    kind = algorithm(name)
    given = {key: value for key, value in values.items() if value is not None}
    return training_options.make_options(kind, known_options(kind).read(given, "a test"))


def small(name: str, **changed: Any) -> TrainingOptions:
    return options_of(name, SMALL[name] | changed)


def run(options: TrainingOptions, folder: Path, interrupt: Interrupt | None = None) -> Path:
    """With an empty picture of the curves: to draw it takes longer than to train."""
    folder.mkdir(parents=True, exist_ok=True)
    with mock.patch("rl_workbench.plotting.as_png", lambda figure: lambda file: file.write(b"")):
        Training(options, folder, interrupt or Interrupt()).run()
    return folder


def train(folder: Path, name: str, interrupt: Interrupt | None = None, **changed: Any) -> Path:
    return run(small(name, **changed), folder, interrupt)


def resume(folder: Path, interrupt: Interrupt | None = None, **extended: Any) -> Path:
    given = ["--resume", str(folder), *flags(extended)]
    return run(choose(recorded_kind(folder), given), folder, interrupt)


def summary(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text())


def record(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "config.json").read_text())


def files(folder: Path) -> set[str]:
    """The names in a run folder; TensorBoard's depends on the clock."""
    return {path.name for path in folder.iterdir() if not path.name.startswith("events.out")}


def checkpoint(run: Path, name: str = "last.pt") -> dict[str, Any]:
    """A checkpoint without what depends on the wall clock, or on the folder's name."""
    content = torch.load(run / name, weights_only=True)
    del content["log_bytes"]  # the CSV has numbers of steps per second
    del content["history"]["seconds"], content["config"]["run"]["run_dir"]
    return content


def rows(run: Path) -> list[tuple[str, str, str]]:
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
    """Checkpoints, figures and networks of two trainings."""
    for name in ("last.pt", "best.pt"):
        assert_same(checkpoint(first, name), checkpoint(second, name), name)
    assert rows(first) == rows(second)
    assert points(first) == points(second)
    networks = {path.name for path in first.glob("*.pth")}
    assert networks == {path.name for path in second.glob("*.pth")}
    for name in networks:
        mine, other = (torch.load(run / name, weights_only=True) for run in (first, second))
        assert_same(mine, other, name)


def assert_no_doubles(run: Path) -> None:
    """No step and tag comes twice, and TensorBoard shows what the CSV holds."""
    found = rows(run)
    keys = [row[:2] for row in found]
    assert len(keys) == len(set(keys))
    shown = points(run)
    for tag in {tag for _, tag, _ in found}:
        wanted = [int(step) for step, its, _ in found if its == tag]
        assert [step for step, _ in shown.pop(tag)] == wanted
    assert not shown


def failure(train_it: Callable[[], object]) -> str:
    """The one line with which a training fails."""
    with pytest.raises(WorkbenchError) as raised:
        train_it()
    assert "\n" not in str(raised.value)
    return str(raised.value)
