"""What goes wrong around a training: a clear line each, and nothing that was learned is lost."""

import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import gymnasium
import pytest
import torch
from support.training import training_runs as runs
from support.training.learning_fakes import POLE, SPOILT, Died, Pole
from support.training.training_runs import EXACT, checkpoint, failure, resume, summary, train

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.training.callbacks import ScalarLogger
from rl_workbench.training.evaluator import Evaluator

ON_A_ROBOT = {"env_id": POLE, "env_kwargs": {"noise": 0.05}}
LEARNERS = [*EXACT, runs.OTHERS[0]]  # from single actions


def fill_disk(monkeypatch: pytest.MonkeyPatch, when: Callable[[], bool]) -> None:
    """Nothing more goes to the disk while `when` is true."""

    def fsync(descriptor: int) -> None:
        if when():
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fsync)


@pytest.mark.parametrize("name", runs.ALL)
def test_a_disk_that_is_full_from_the_beginning_fails_before_tensorboard(tmp_path, name) -> None:
    """TensorBoard writes in a thread of its own, which would end in a traceback."""
    (tmp_path / "scalars.csv").symlink_to("/dev/full")
    line = failure(lambda: train(tmp_path, name))
    assert "No space left on device; stopped after 0 steps" in line
    assert "is saved" not in line and "--resume" not in line
    assert not list(tmp_path.glob("events.*"))


@pytest.mark.slow
@pytest.mark.parametrize("name", runs.ALL)
def test_a_disk_that_fills_up_keeps_a_checkpoint(whole, tmp_path, monkeypatch, name: str) -> None:
    run = tmp_path / "run"

    def is_full() -> bool:
        return len(list(run.glob("checkpoints/step_*.pt"))) == 3

    with monkeypatch.context() as disk:
        fill_disk(disk, is_full)
        line = failure(lambda: train(run, name, keep_checkpoints=0))
    assert "No space left on device" in line and "is saved" not in line
    assert f"--resume {run} continues from the last checkpoint" in line
    assert 0 < checkpoint(run)["steps"] < summary(whole(name))["steps"]
    resume(run)
    assert summary(run)["complete"] and summary(run)["failure"] is None
    if name in EXACT:
        assert summary(run)["returns"] == summary(whole(name))["returns"]


class MovedAfter(runs.InterruptAfter):
    """The run folder is moved when the training asks for the n-th time; it isn't interrupted."""

    def __init__(self, asked: int, folder: Path, comes: Path | None) -> None:
        super().__init__()
        self._moved_at, self._folder, self._comes = asked, folder, comes

    def requested(self) -> bool:
        super().requested()
        if self.times == self._moved_at:
            self._folder.rename(self._folder.with_name("moved"))
            if self._comes:
                shutil.copytree(self._comes, self._folder)
        return False


def contents(folder: Path) -> dict[str, bytes]:
    paths = [path for path in folder.rglob("*") if path.is_file()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


@pytest.mark.slow
@pytest.mark.parametrize("is_replaced", [True, False])
@pytest.mark.parametrize("name", EXACT)
def test_a_folder_moved_away_is_one_line(whole, times, tmp_path, capsys, name, is_replaced) -> None:
    """Another run that comes into its place is left alone."""
    (run := tmp_path / "run").mkdir()
    other, moved_at = whole(name) if is_replaced else None, round(0.5 * times(name))
    capsys.readouterr()
    line = failure(lambda: train(run, name, MovedAfter(moved_at, run, other)))
    assert f"can't write {run}: the folder was moved or removed; stopped" in line
    assert "--resume" not in line and "all results are in" not in capsys.readouterr().out
    if other:
        assert contents(run) == contents(other)
    else:
        assert not run.exists()
    runs.assert_same_run(whole(name), resume(tmp_path / "moved"))


@pytest.mark.parametrize("name", LEARNERS)
@pytest.mark.parametrize("what", ["observation", "reward"])
def test_a_number_that_is_none_ends_it_and_is_not_learned_from(tmp_path, name, what) -> None:
    options = {"env_id": SPOILT, "env_kwargs": {what: -1e39}, "eval_frequency": 0}
    line = failure(lambda: train(tmp_path, name, **options))
    assert f"the {what} of {SPOILT} isn't finite in float32" in line
    assert "progress is saved in" in line and "--resume" in line
    assert all_finite(checkpoint(tmp_path))
    assert summary(tmp_path)["failure"] and not summary(tmp_path)["complete"]


def all_finite(content: object) -> bool:
    if isinstance(content, dict):
        return all(all_finite(each) for each in content.values())
    if isinstance(content, list | tuple):
        return all(all_finite(each) for each in content)
    return not isinstance(content, torch.Tensor) or bool(content.isfinite().all())


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [("dqn", {"loss": "mse"}, "the loss is inf"),
     ("reinforce", {"batch_episodes": 1}, "loss is"),
     ("reinforce-document", {}, "loss is inf"),
     pytest.param("ppo", {"normalize_advantage": "false"}, "losses/loss is (inf|nan)",
                  marks=pytest.mark.extras("stable_baselines3"))],
)  # fmt: skip
def test_a_loss_that_is_no_number_leaves_the_networks(tmp_path, name, options, words) -> None:
    huge = {"env_id": SPOILT, "env_kwargs": {"reward": 3e38}, "eval_frequency": 0}
    with pytest.raises(WorkbenchError, match=f"({words}).*--resume"):
        train(tmp_path, name, **huge, **options)
    content = checkpoint(tmp_path)
    networks = {key: content[key] for key in ("q_net", "agent", "policy") if key in content}
    assert networks and all_finite(networks)


def dying(monkeypatch: pytest.MonkeyPatch, after: int) -> None:
    monkeypatch.setitem(gymnasium.registry[POLE].kwargs, "dies_after", after)


@pytest.mark.slow
@pytest.mark.parametrize("name", LEARNERS)
def test_a_simulator_that_dies_costs_nothing_that_was_saved(tmp_path, monkeypatch, name) -> None:
    """PPO takes back the rollout under way, the policy gradients their episode."""
    options = ON_A_ROBOT | {"eval_frequency": 0, "checkpoint_frequency": 70 * (name == "dqn")}
    whole = train(tmp_path / "whole", name, **options)
    with monkeypatch.context() as patched:
        dying(patched, 100)
        line = failure(lambda: train(tmp_path / "run", name, **options))
    assert f"the simulator has ended; stopped after {summary(tmp_path / 'run')['steps']} " in line
    assert f"progress is saved in {tmp_path / 'run'}; --resume" in line
    result = summary(tmp_path / "run")
    assert result["failure"] == "the connection broke; the simulator has ended"
    assert checkpoint(tmp_path / "run")["steps"] == result["steps"]
    if name in ("dqn", "ppo"):
        assert result["steps"] == (100 if name == "dqn" else 64)
    else:
        assert 0 < result["steps"] == sum(result["lengths"]) <= 100
    runs.assert_same_run(whole, resume(tmp_path / "run"))


def fails_at(monkeypatch: pytest.MonkeyPatch, place: type, method: str, call: int) -> None:
    """The n-th call of a method raises after what it does; a reset draws once more before that."""
    calls, keep = [0], getattr(place, method)

    def failing(*arguments: object, **options: object) -> object:
        calls[0] += 1
        result = keep(*arguments, **options)
        if calls[0] == call:
            if method == "reset":
                random.random()
            raise (Died if place is Pole else WorkbenchError)("the simulator has ended")
        return result

    monkeypatch.setattr(place, method, failing)


FREELY = ON_A_ROBOT | {"checkpoint_frequency": 0, "total_timesteps": 300}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return train(tmp_path_factory.mktemp("undisturbed"), "dqn", **FREELY)


@pytest.mark.parametrize("shares_robot", [False, True])
@pytest.mark.parametrize(
    ("place", "method", "call"),
    [(Pole, "step", 98), (Pole, "reset", 3), (Pole, "reset", 6), (ScalarLogger, "on_step", 98),
     (ScalarLogger, "on_episode", 4), (Evaluator, "_episodes", 1)],
)  # fmt: skip
def test_dqn_saves_its_last_whole_step_wherever_it_fails(
    undisturbed, tmp_path: Path, monkeypatch, place, method: str, call: int, shares_robot: bool
) -> None:
    monkeypatch.setattr(Pole, "shares_robot", shares_robot, raising=False)
    with monkeypatch.context() as patched:
        fails_at(patched, place, method, call)
        line = failure(lambda: train(tmp_path, "dqn", **FREELY))
    steps = summary(tmp_path)["steps"]
    assert checkpoint(tmp_path)["steps"] == steps > 0
    assert f"stopped after {steps} steps" in line and "progress is saved in" in line
    runs.assert_same_run(undisturbed, resume(tmp_path))


def test_a_round_of_learning_that_fails_costs_the_steps_since_the_last_checkpoint(tmp_path) -> None:
    """Its first gradient steps can't be taken back."""
    huge = {"env_id": SPOILT, "env_kwargs": {"reward": 3e38}, "eval_frequency": 0}
    line = failure(lambda: train(tmp_path, "dqn", loss="mse", checkpoint_frequency=20, **huge))
    steps = checkpoint(tmp_path)["steps"]
    assert 0 < steps < summary(tmp_path)["steps"]
    assert f"progress up to step {steps} is saved in {tmp_path}; --resume" in line


def test_a_round_that_was_not_recorded_is_played_again(tmp_path: Path, monkeypatch) -> None:
    options = ON_A_ROBOT | {"checkpoint_frequency": 20}
    whole = train(tmp_path / "whole", "reinforce", **options)
    with monkeypatch.context() as patched:
        fails_at(patched, ScalarLogger, "on_episode", 4)
        failure(lambda: train(tmp_path / "run", "reinforce", **options))
    assert 0 < checkpoint(tmp_path / "run")["steps"] < summary(whole)["steps"]
    runs.assert_same_run(whole, resume(tmp_path / "run"))


@pytest.mark.slow
@pytest.mark.parametrize("name", EXACT)
def test_one_that_is_dead_from_the_start(tmp_path: Path, monkeypatch, name: str) -> None:
    """Neither a new training nor one that is gone on with; that one keeps what it has."""

    def dead(*arguments: object, **options: object) -> None:
        raise Died("the simulator has ended")

    run = train(tmp_path / "run", name, runs.InterruptAfter(90), **ON_A_ROBOT)
    before = {each: (run / each).read_bytes() for each in runs.files(run) if each.endswith("t")}
    monkeypatch.setattr(Pole, "reset", dead)
    assert "the simulator has ended; stopped after 0" in failure(
        lambda: train(tmp_path / "new", name, **ON_A_ROBOT)
    )
    returns = summary(run)["returns"]
    line = failure(lambda: resume(run))
    assert f"the simulator has ended; stopped after {summary(run)['steps']} " in line
    assert "--resume" in line and summary(run)["returns"] == returns != []
    assert before == {each: (run / each).read_bytes() for each in before}


def test_a_simulator_that_dies_of_the_same_ctrl_c_is_no_failure(tmp_path, monkeypatch) -> None:
    def step(env: Pole, action: int) -> tuple:
        interrupt.signal = 2
        raise Died("the simulator has ended")

    interrupt = Interrupt()
    monkeypatch.setattr(Pole, "step", step)
    assert summary(train(tmp_path, "dqn", interrupt, **ON_A_ROBOT))["interrupted"]


@pytest.mark.slow
@pytest.mark.parametrize("after", [None, 100])
@pytest.mark.parametrize("name", LEARNERS)
def test_every_environment_is_closed_once(tmp_path, monkeypatch, name, after) -> None:
    closed: list[Pole] = []
    monkeypatch.setattr(Pole, "close", lambda env: closed.append(env))  # noqa: PLW0108 - binds
    if after is None:
        train(tmp_path, name, **ON_A_ROBOT)
    else:
        dying(monkeypatch, after)
        failure(lambda: train(tmp_path, name, **ON_A_ROBOT, eval_frequency=0))
    assert len(closed) == len({id(env) for env in closed}) == 2
