"""examples/*_callback.py log a training; the trackers are stand-ins that record what they are given."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from rl_workbench import train

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


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
    example: str,
    made: str,
    logged: str,
    ended: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    name = example.removesuffix("Callback").lower()
    tracker = Tracker(name)
    monkeypatch.setitem(sys.modules, name, tracker)
    file = EXAMPLES / f"{name}_callback.py"
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    train(
        "dqn",
        callbacks=[getattr(module, example)()],
        env_id="CartPole-v1",
        run_dir=tmp_path / "run",
        total_timesteps=300,
        eval_frequency=150,
        eval_episodes=1,
        confirm_episodes=1,
        learning_starts=50,
    )
    names = [call[0] for call in tracker.calls]
    assert made in names and names[-1] == ended
    assert names.count(logged) >= 3  # episodes and two evaluations
    assert any("best.pt" in str(call[1]) for call in tracker.calls)
