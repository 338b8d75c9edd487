"""examples/*_callback.py log a training; the trackers are stand-ins that record what they are given."""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from rl_workbench import train


class Tracker(ModuleType):
    """Any function of it records its name and arguments, and returns the tracker itself."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.calls: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = []

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)

        def called(*arguments: Any, **options: Any) -> Any:
            self.calls.append((name, arguments, options))
            return self

        return called


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "made", "logged", "ended"),
    [("WandbCallback", "init", "log", "finish"), ("MlflowCallback", "start_run", "log_metric", "end_run")],
)  # fmt: skip
def test_a_training_is_logged(
    example: str, made: str, logged: str, ended: str, imported, tmp_path: Path, monkeypatch
) -> None:
    name = example.removesuffix("Callback").lower()
    tracker = Tracker(name)
    monkeypatch.setitem(sys.modules, name, tracker)
    callback = getattr(imported(f"{name}_callback"), example)()
    short = {"total_timesteps": 300, "eval_frequency": 150, "eval_episodes": 1, "confirm_episodes": 1}
    robot = {"env_id": "CartPole-v1", "learning_starts": 50, "run_dir": tmp_path / "run"}
    train("dqn", callbacks=[callback], **robot, **short)
    names = [call[0] for call in tracker.calls]
    assert made in names and names[-1] == ended
    assert names.count(logged) >= 3  # episodes and two evaluations
    assert any("best.pt" in str(call[1]) for call in tracker.calls)
