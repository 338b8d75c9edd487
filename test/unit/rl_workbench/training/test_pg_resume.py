"""Interrupted anywhere, resumed: a training ends with the bits with which it would have ended."""

import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from dqn_runs import InterruptAfter, flags, without_doubles
from learning_fakes import Dicing, FakePlant, OnlyOne, register_with
from pg_runs import CARTPOLE, assert_same_run, checkpoint, resume, train

from cartpole import robot
from rl_workbench.errors import WorkbenchError
from robot_envs.backends.in_process import InProcessRobot

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


@pytest.mark.parametrize("asked", [37, 60])
@pytest.mark.parametrize("kind", [Dicing, OnlyOne])
def test_whatever_generator_an_environment_draws_from_comes_back(
    tmp_path: Path, monkeypatch, kind: type, asked: int
) -> None:
    options = CARTPOLE | {"env_id": register_with(monkeypatch, kind)}
    whole = train(tmp_path / "whole", **options)
    run = train(tmp_path / "run", InterruptAfter(asked), **options)
    resume(run)
    assert_same_run(whole, run)


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


def test_an_evaluation_that_a_checkpoint_knows_of_is_not_held_again(tmp_path: Path) -> None:
    options = CARTPOLE | {"checkpoint_frequency": 4}
    whole, run = (train(tmp_path / name, **options) for name in ("whole", "run"))
    for path in (run / "last.pt", sorted((run / "checkpoints").iterdir())[-1]):
        path.unlink()  # killed after the one of episode 12
    assert (
        len(checkpoint(run, sorted((run / "checkpoints").iterdir())[-1])["history"]["evaluations"])
        == 3
    )
    resume(run)
    assert_same_run(whole, run)
    without_doubles(run)


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
    with pytest.raises(WorkbenchError, match="no checkpoint to go on from"):
        resume(run)


def test_killed_before_the_first_checkpoint_it_begins_anew(
    whole: dict[str, Path], tmp_path: Path, capsys
) -> None:
    run = train(tmp_path / "run", InterruptAfter(2), **KINDS["gae"])
    for path in (run / "last.pt", *(run / "checkpoints").iterdir()):
        path.unlink()
    (run / "checkpoints/.step_000000000.pt.abc").write_bytes(b"PK")
    resume(run)
    assert "beginning anew" in capsys.readouterr().out
    assert_same_run(whole["gae"], run)
    without_doubles(run)
    assert not list((run / "checkpoints").glob(".*"))


def test_a_checkpoint_of_another_training_is_refused(tmp_path: Path) -> None:
    run = train(tmp_path / "run", episodes=2)
    record = json.loads((run / "config.json").read_text())
    record["run"]["seed"] = 9
    (run / "config.json").write_text(json.dumps(record))
    with pytest.raises(WorkbenchError, match=r"config.json says seed 9, the checkpoint 0"):
        resume(run)


def test_a_checkpoint_of_another_agent_is_refused(tmp_path: Path) -> None:
    run = train(tmp_path / "run", episodes=2)
    content = torch.load(run / "last.pt", weights_only=True)
    content["agent"]["policy"] = {}
    torch.save(content, run / "last.pt")
    with pytest.raises(WorkbenchError, match="doesn't hold the agent"):
        resume(run)


def test_a_checkpoint_loads_safely_and_has_it_all(whole: dict[str, Path]) -> None:
    content = torch.load(whole["CartPole-v1"] / "last.pt", weights_only=True)
    assert {"config", "agent", "history", "random", "steps", "log_bytes"} < set(content)
    agent = {"policy", "value", "policy_optimizer", "value_optimizer", "generator", "batch"}
    assert agent < set(content["agent"])
    assert len(content["agent"]["batch"]) == 1, "13 episodes are four batches and one more"


def test_the_robot_in_process_resumes_exactly(tmp_path: Path) -> None:
    options = {"episodes": 12, "seed": 5, "algorithm": "gae", "eval_episodes": 1}
    options |= {"checkpoint_frequency": 5, "start_noise": 0.02}
    plants = [InProcessRobot(robot.ROBOT, robot.CONTROL_PERIOD) for _ in range(3)]
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


BULLET = {"backend": "bullet", "algorithm": "gae", "episodes": 40, "eval_episodes": 2}
PLAIN = {"env_id": "CartPole-v1", "episodes": 70, "eval_episodes": 2, "eval_frequency": 20}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "seed"), [(BULLET, 0), (PLAIN, 1)], ids=["robot", "CartPole-v1"]
)
def test_killed_at_random_moments(root: Path, tmp_path: Path, options: dict, seed: int) -> None:
    options = options | {"checkpoint_frequency": 2}
    run, moments = tmp_path / "run", random.Random(seed)
    process, killed = start(root, *flags(options), f"--run-dir={run}"), 0
    plant = InProcessRobot(robot.ROBOT, robot.CONTROL_PERIOD)
    whole = train(tmp_path / "whole", plant=plant, **options)
    plant.close()
    for _ in range(2):
        news(run, process, (run / "last.pt").stat().st_mtime_ns if killed else 0)
        time.sleep(moments.uniform(0, 0.2))
        process.kill()
        process.communicate()
        killed += process.returncode == -signal.SIGKILL
        process = start(root, f"--resume={run}")
    ended(process)
    assert killed
    assert_same_run(whole, run)
    without_doubles(run)
