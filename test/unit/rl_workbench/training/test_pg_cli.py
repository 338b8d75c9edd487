"""The command line: what the user sees, and one clear line for each thing that goes wrong."""

import json
import os
import re
from pathlib import Path

import pytest

from rl_workbench.training.pg import cli as pg_cli
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.interrupt import Interrupt

SHORT = ["--episodes=2", "--eval-episodes=1"]
PLAIN = ["--env-id=CartPole-v1", *SHORT]


@pytest.fixture(autouse=True)
def _no_signals_and_no_master(monkeypatch, tmp_path) -> None:
    """The command takes over signals, and asks a master for parameters."""
    monkeypatch.setattr(Interrupt, "install", lambda self: self)
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    monkeypatch.chdir(tmp_path)


def failed(capsys, *flags: str) -> str:
    """Runs the command; returns its one line."""
    capsys.readouterr()
    assert pg_cli.main([*flags]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("pg_train: ")
    return lines[0]


def test_an_environment_of_gymnasium(tmp_path: Path, capsys) -> None:
    assert pg_cli.main([*PLAIN, "--seed=5"]) == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert re.fullmatch(r"CartPole-v1__gae__5__\d+", run.name)
    output = capsys.readouterr().out
    assert str(run) in output and "training in CartPole-v1 for 2 episodes" in output


def test_the_robot_in_this_process(tmp_path: Path) -> None:
    assert pg_cli.main([*SHORT, "--backend=bullet", "--exp-name=mine"]) == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert run.name.startswith("cartpole__mine__0__")


def test_resumed(tmp_path: Path, capsys) -> None:
    assert pg_cli.main([*PLAIN, "--run-dir=run"]) == 0
    assert pg_cli.main(["--resume=run", "--episodes=3"]) == 0
    assert "going on after episode 2 of 3" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("env_id", "words"),
    [
        ("CartPol-v1", "unknown environment 'CartPol-v1'; did you mean CartPole-v1?"),
        (
            "Pendulum-v1",
            "REINFORCE needs a choice of single actions, Discrete(n); Pendulum-v1 has Box",
        ),
        ("cartpole/SwingUp-v0", "PPO, A2C, SAC, TD3 or DDPG fit it"),
    ],
)
def test_an_environment_that_does_not_do(capsys, tmp_path: Path, env_id: str, words: str) -> None:
    assert words in failed(capsys, f"--env-id={env_id}", "--run-dir=run")
    assert not (tmp_path / "run").exists()


def test_private_parameters_on_the_command_line(tmp_path: Path, capsys) -> None:
    assert pg_cli.main([*PLAIN, "--run-dir=run", "_gamma:=0.5", "_batch_episodes:=2"]) == 0
    record = json.loads((tmp_path / "run/config.json").read_text())
    assert (record["pg"]["gamma"], record["pg"]["batch_episodes"]) == (0.5, 2)
    assert "did you mean gamma" in failed(capsys, *PLAIN, "_gama:=0.5")


def test_a_run_folder_in_use(capsys, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mine").write_text("")
    assert "isn't empty" in failed(capsys, *PLAIN, "--run-dir=run")
    assert (tmp_path / "run" / "mine").exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="/proc can't be written to by anybody")
def test_a_folder_that_cannot_be_written(capsys) -> None:
    assert "can't write to the run folder" in failed(capsys, *PLAIN, "--run-dir=/proc/run")


def test_a_training_that_runs_cannot_be_resumed(capsys, tmp_path: Path) -> None:
    assert pg_cli.main([*PLAIN, "--run-dir=run"]) == 0
    with run_folder.held(tmp_path / "run"):
        assert "a training is running in" in failed(capsys, "--resume=run")


def test_ctrl_c_before_the_training(capsys, monkeypatch) -> None:
    def interrupted(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(pg_cli, "run", interrupted)
    assert pg_cli.main(PLAIN) == 130
    assert "before the training began" in capsys.readouterr().err
