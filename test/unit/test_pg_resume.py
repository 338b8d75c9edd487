"""Interrupted anywhere, resumed: a training ends with the bits with which it would have ended."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from unit.dqn_runs import without_doubles
from unit.learning_fakes import FakePlant
from unit.pg_runs import CARTPOLE, InterruptAfter, assert_same_run, checkpoint, resume, train

from cartpole.errors import CartpoleError

ROBOT = {"episodes": 18, "start_noise": 0.05, "save_every": 10, "seed": 2, "eval_episodes": 3,
         "checkpoint_frequency": 7}  # fmt: skip
KINDS = {
    "document": ROBOT,
    "gae": ROBOT | {"algorithm": "gae", "batch_episodes": 2, "eval_frequency": 6},
    "CartPole-v1": CARTPOLE,
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("whole")
    return {kind: train(folder / kind, **options) for kind, options in KINDS.items()}


@pytest.mark.parametrize("asked", [2, 77, 150])
@pytest.mark.parametrize("kind", KINDS)
def test_ctrl_c_anywhere_and_resumed(
    whole: dict[str, Path], tmp_path: Path, kind: str, asked: int
) -> None:
    run = train(tmp_path / "run", InterruptAfter(asked), **KINDS[kind])
    resume(run, InterruptAfter(asked + 40))
    resume(run)
    assert_same_run(whole[kind], run)
    without_doubles(run)


def test_ctrl_c_in_an_evaluation(whole: dict[str, Path], tmp_path: Path) -> None:
    class InEvaluation(InterruptAfter):
        def requested(self) -> bool:
            names = []
            frame = sys._getframe(1)
            while frame:
                names.append(frame.f_code.co_name)
                frame = frame.f_back
            return super().requested() if "run_greedily" in names else self.signal is not None

    run = train(tmp_path / "run", InEvaluation(30), **KINDS["CartPole-v1"])
    resume(run)
    assert_same_run(whole["CartPole-v1"], run)


@pytest.mark.parametrize("kind", KINDS)
def test_resuming_a_complete_training_changes_nothing(
    whole: dict[str, Path], tmp_path: Path, kind: str
) -> None:
    run = train(tmp_path / "run", **KINDS[kind])
    resume(run)
    assert_same_run(whole[kind], run)


@pytest.mark.parametrize("kind", KINDS)
def test_a_complete_training_prolonged_is_a_longer_one(
    whole: dict[str, Path], tmp_path: Path, kind: str
) -> None:
    run = train(tmp_path / "run", **KINDS[kind] | {"episodes": 8})
    resume(run, episodes=KINDS[kind]["episodes"])
    assert_same_run(whole[kind], run)


def test_a_damaged_checkpoint_is_told_and_the_one_before_is_used(
    whole: dict[str, Path], tmp_path: Path, capsys
) -> None:
    run = train(tmp_path / "run", InterruptAfter(1000), **KINDS["gae"])
    data = (run / "last.pt").read_bytes()
    for path in (run / "last.pt", sorted((run / "checkpoints").iterdir())[-1]):
        path.write_bytes(data[: len(data) // 2])
    capsys.readouterr()
    resume(run)
    assert "last.pt is damaged" in capsys.readouterr().out
    assert_same_run(whole["gae"], run)


def test_without_any_good_checkpoint_resuming_is_refused(tmp_path: Path) -> None:
    run = train(tmp_path / "run", episodes=2)
    for path in run.rglob("*.pt"):
        path.write_bytes(b"")
    with pytest.raises(CartpoleError, match="no checkpoint to go on from"):
        resume(run)


def test_a_checkpoint_loads_safely_and_has_it_all(whole: dict[str, Path]) -> None:
    content = torch.load(whole["CartPole-v1"] / "last.pt", weights_only=True)
    assert {"config", "agent", "history", "random", "steps", "log_bytes"} < set(content)
    agent = {"policy", "value", "policy_optimizer", "value_optimizer", "generator", "batch"}
    assert agent < set(content["agent"])
    assert len(content["agent"]["batch"]) == 1, "13 episodes are four batches and one more"


def test_the_robot_in_process_resumes_exactly(tmp_path: Path) -> None:
    from cartpole.envs.bullet_plant import BulletPlant

    options = {"episodes": 12, "seed": 5, "algorithm": "gae", "eval_episodes": 1}
    options |= {"checkpoint_frequency": 5, "start_noise": 0.02}
    plants = [BulletPlant() for _ in range(3)]
    first = train(tmp_path / "first", plant=plants[0], **options)
    second = train(tmp_path / "second", InterruptAfter(307), plants[1], **options)
    resume(second, plant=plants[2])
    assert_same_run(first, second)
    for plant in plants:
        plant.close()


def test_a_fake_that_remembers_is_no_hindrance(whole: dict[str, Path], tmp_path: Path) -> None:
    plant = FakePlant()
    run = train(tmp_path / "run", InterruptAfter(90), plant, **KINDS["document"])
    resume(run, plant=plant)
    assert checkpoint(run)["steps"] == checkpoint(whole["document"])["steps"]


def start(root: Path, *flags: str) -> subprocess.Popen:
    command = [sys.executable, str(root / "scripts/pg_train.py"), *flags]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def ended(process: subprocess.Popen, code: int = 0) -> str:
    output, _ = process.communicate(timeout=120)
    assert process.returncode == code, output
    assert "Traceback" not in output
    return output


def news(run: Path, process: subprocess.Popen, before: int) -> None:
    """Waits for a newer checkpoint: starting up takes longer than all the rest."""
    deadline = time.monotonic() + 60
    while process.poll() is None and not (
        (run / "last.pt").exists() and (run / "last.pt").stat().st_mtime_ns > before
    ):
        assert time.monotonic() < deadline
        time.sleep(0.005)


BULLET = ["--backend=bullet", "--algorithm=gae", "--episodes=40", "--eval-episodes=2"]
PLAIN = ["--env-id=CartPole-v1", "--episodes=70", "--eval-episodes=2", "--eval-frequency=20"]


@pytest.mark.slow
@pytest.mark.parametrize(("flags", "seed"), [(BULLET, 0), (PLAIN, 1)], ids=["robot", "CartPole-v1"])
def test_killed_at_random_moments(root: Path, tmp_path: Path, flags: list[str], seed: int) -> None:
    flags = [*flags, "--checkpoint-frequency=2"]
    whole, run, moments = tmp_path / "whole", tmp_path / "run", random.Random(seed)
    complete = start(root, *flags, f"--run-dir={whole}")
    process, killed = start(root, *flags, f"--run-dir={run}"), 0
    for _ in range(2):
        news(run, process, (run / "last.pt").stat().st_mtime_ns if killed else 0)
        time.sleep(moments.uniform(0, 0.2))
        process.kill()
        process.communicate()
        killed += process.returncode == -signal.SIGKILL
        process = start(root, f"--resume={run}")
    ended(process)
    ended(complete)
    assert killed
    assert_same_run(whole, run)
    without_doubles(run)
