"""The command line: what the user sees, and one clear line for each thing that goes wrong."""

import io
import os
import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from dqn_runs import SMALL, flags

from rl_workbench.training.dqn import cli as dqn_cli
from rl_workbench.training.dqn.loop import Episode, History
from rl_workbench.training.dqn.progress import DQNProgress
from rl_workbench.training.run.interrupt import Interrupt

FLAGS = flags(SMALL)


@pytest.fixture(autouse=True)
def _no_signals_and_no_master(monkeypatch, tmp_path) -> None:
    """The command takes over signals, and asks a master for parameters."""
    monkeypatch.setattr(Interrupt, "install", lambda self: self)
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    monkeypatch.chdir(tmp_path)


def failed(capsys, *more: str) -> str:
    """Runs the command; returns its one line."""
    assert dqn_cli.main([*FLAGS, *more]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("dqn_train: ")
    return lines[0]


def test_a_training_from_the_command_line(tmp_path: Path, capsys) -> None:
    assert dqn_cli.main([*FLAGS, "--exp-name=mine", "--seed=5"]) == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert re.fullmatch(r"CartPole-v1__mine__5__\d+", run.name)
    output = capsys.readouterr()
    assert str(run) in output.out and "trained" in output.out
    assert re.search(r"^Episode   20 \| Reward: +\d+ \| Avg\(20\): +[\d.]+ \| ε: 0\.\d{3}$",
                     output.err, re.MULTILINE)  # fmt: skip


def test_an_id_with_a_namespace_is_one_folder(tmp_path: Path) -> None:
    assert dqn_cli.main([*FLAGS, "--env-id=cartpole/Classic-v0", "--total-timesteps=60"]) == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert run.name.startswith("cartpole-Classic-v0__dqn__0__")


@pytest.mark.parametrize(
    ("env_id", "words"),
    [
        ("CartPol-v1", "unknown environment 'CartPol-v1'; did you mean CartPole-v1?"),
        ("CartPole-v7", "did you mean CartPole-v1?"),
        ("zzz", "unknown environment 'zzz'"),
        ("no_such_module:Env-v0", "can't make no_such_module:Env-v0"),
        ("Pendulum-v1", "DQN needs a choice of single actions, Discrete(n); Pendulum-v1 has Box"),
        ("cartpole/SwingUp-v0", "PPO, A2C, SAC, TD3 or DDPG fit it"),
    ],
)
def test_an_environment_that_does_not_do(capsys, tmp_path: Path, env_id: str, words: str) -> None:
    assert words in failed(capsys, f"--env-id={env_id}", f"--run-dir={tmp_path / 'run'}")
    assert not (tmp_path / "run").exists()


def test_options_that_an_environment_does_not_know(capsys) -> None:
    assert "can't make CartPole-v1" in failed(capsys, "--env-kwargs=wheels=4")


def test_a_device_that_is_not_there(capsys) -> None:
    assert "torch can't use the device 'cda'" in failed(capsys, "--device=cda")


def test_a_run_folder_in_use(capsys, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mine").write_text("")
    assert "isn't empty" in failed(capsys, f"--run-dir={tmp_path / 'run'}")
    assert (tmp_path / "run" / "mine").exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="/proc can't be written to by anybody")
def test_a_folder_that_cannot_be_written(capsys) -> None:
    assert "can't write to the run folder" in failed(capsys, "--run-dir=/proc/run")


def test_nothing_to_resume(capsys, tmp_path: Path) -> None:
    assert dqn_cli.main([f"--resume={tmp_path}"]) == 1
    assert "is no run folder" in capsys.readouterr().err


def test_ctrl_c_before_the_training(capsys, monkeypatch) -> None:
    def interrupted(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(dqn_cli, "run", interrupted)
    assert dqn_cli.main(FLAGS) == 130
    assert "before the training began" in capsys.readouterr().err


def test_other_observations_are_flattened(tmp_path: Path) -> None:
    """FrozenLake observes one number of 16."""
    assert isinstance(gymnasium.make("FrozenLake-v1").observation_space, gymnasium.spaces.Discrete)
    assert dqn_cli.main([*FLAGS, "--env-id=FrozenLake-v1", "--total-timesteps=150"]) == 0


def test_the_line_is_the_documents() -> None:
    stream, history = io.StringIO(), History()
    history.returns = [11.0] * 10 + [17.5] * 9 + [18.5]
    shown = DQNProgress(1000, 0, history, stream)
    shown.episode_done(Episode(19, 290, 18, 18.0, 0.9046, 1000.0))
    average = f"{np.mean(history.returns):6.1f}"
    line = f"Episode   20 | Reward:  18 | Avg(20): {average} | ε: 0.905\n"
    assert stream.getvalue() == line


def test_on_a_terminal_a_bar_with_return_epsilon_and_speed() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    stream, history = Terminal(), History(returns=[5.0])
    shown = DQNProgress(100, 0, history, stream)
    shown.episode_done(Episode(0, 5, 5, 5.0, 0.5, 1234.0))
    shown.close()
    assert "0/100" in stream.getvalue()
    stream = Terminal()
    shown = DQNProgress(100, 50, history, stream)
    for steps in range(51, 101):
        shown.step_done(steps)
    shown.close()
    assert "100/100" in stream.getvalue(), "it ends where the training has ended"
