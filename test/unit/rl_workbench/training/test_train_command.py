"""`train`: one command line for every algorithm; what the user sees, and one line for what goes wrong."""

import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.training.training_runs import SMALL, flags, record, summary

from rl_workbench.training import train as cli
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.folder import held
from rl_workbench.training.train import choose_training, main

SHORT = {"total_timesteps": 60, "eval_episodes": 1, "confirm_episodes": 0}
DQN = ["--algo=dqn", *flags(SMALL["dqn"] | SHORT)]
REINFORCE = ["--algo=reinforce", *flags({"episodes": 2, "eval_episodes": 1})]
NAMES = ", ".join(ALGORITHMS)


@pytest.fixture(autouse=True)
def _here(monkeypatch, tmp_path: Path) -> None:
    """Where runs/ is made."""
    monkeypatch.chdir(tmp_path)


def failed(capsys, *arguments: str, code: int = 1) -> str:
    """Runs the command; returns its one line."""
    capsys.readouterr()
    assert main(list(arguments)) == code
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("rl-workbench train: ")
    return lines[0]


def refused(capsys, *arguments: str) -> str:
    """What is wrong with the arguments, the last line after the usage."""
    code, _, told = told_and_left(capsys, *arguments)
    usage, line = told.splitlines()
    assert code == 2 and usage.startswith("usage: ") and ": error: " in line
    return line


def told_and_left(capsys, *arguments: str) -> tuple[int, str, str]:
    """Exit code, standard output and error of wrong arguments, or of --help."""
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return (ended.value.code, *capsys.readouterr())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "options"),
    [("dqn", SMALL["dqn"]), ("reinforce", {"episodes": 22}), ("reinforce-document", {"episodes": 22}),
     pytest.param("a2c", {"total_timesteps": 600},
                  marks=pytest.mark.extras("stable_baselines3"))],
)  # fmt: skip
def test_a_training_from_the_command_line(tmp_path: Path, capsys, name: str, options: dict) -> None:
    given = flags(options | {"eval_episodes": 1, "confirm_episodes": 0})
    arguments = [f"--algo={name}", "--env-id=CartPole-v1", *given]
    assert main([*arguments, "--seed=5"]) == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert re.fullmatch(rf"CartPole-v1__{name}__5__\d+", run.name)
    output = capsys.readouterr()
    assert str(run) in output.out and "trained" in output.out
    last = r"ε: 0\.\d{3}" if name == "dqn" else r"\d+ steps/s"
    line = rf"^Episode   20 \| Reward: +\d+ \| Avg\(20\): +[\d.]+ \| {last}$"
    assert re.search(line, output.err, re.MULTILINE)


@pytest.mark.slow
def test_resumed_by_its_folder_alone(tmp_path: Path, capsys) -> None:
    assert main([*REINFORCE, "--run-dir=run"]) == 0
    steps = summary(tmp_path / "run")["steps"]
    assert main(["--resume=run", "--episodes=3"]) == 0
    told = capsys.readouterr().out
    assert f"resuming at step {steps} after episode 2 of 3: {tmp_path / 'run'}" in told
    assert main([*DQN, "--run-dir=other"]) == main(["--resume=other"]) == 0
    assert "resuming at step 60 of 60" in capsys.readouterr().out


def test_parameters_of_a_node(tmp_path: Path) -> None:
    parameters = {"gamma": 0.5, "seed": 4, "dueling": True, "run_dir": "run", "algo": "dqn"}
    assert main([*DQN[1:], "--seed=3"], parameters, "node.py") == 0
    found = record(tmp_path / "run")
    assert (found["hyperparameters"]["gamma"], found["hyperparameters"]["dueling"]) == (0.5, True)
    assert found["run"]["seed"] == 3
    assert main([], {"resume": str(tmp_path / "run")}, "node.py") == 0


def test_a_node_may_have_defaults() -> None:
    options = choose_training([], {}, default="reinforce", env_id="Acrobot-v1")
    assert (options.kind.name, options.run.env_id) == ("reinforce", "Acrobot-v1")
    flags = ["--algo=dqn", "--env-id=A-v0"]
    options = choose_training(flags, {}, default="reinforce", env_id="B-v0")
    assert (options.kind.name, options.run.env_id) == ("dqn", "A-v0")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], f"--algo is missing, one of {NAMES}"),
        (["--seed=1"], "--algo is missing"),
        (["--algo=dqm"], "unknown algorithm 'dqm'; did you mean dqn?"),
        (["--algo=dqn", "--gama=1"], "unknown flag '--gama'; did you mean --gamma?"),
        (["--algo"], "expected one argument"),
    ],
)
def test_wrong_words(capsys, arguments: list[str], words: str) -> None:
    code, _, told = told_and_left(capsys, *arguments)
    assert code == 2 and words in told and "Traceback" not in told


@pytest.mark.slow
def test_a_reader_that_goes_away_before_the_help(tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    helps = ("train --algo=dqn --help", "--help", "eval --help")
    for words, code in (*((each, 0) for each in helps), ("train --algo=dqn --gamma=5", 2)):
        done = subprocess.run(
            [sys.executable, "-m", "rl_workbench", *words.split()],
            stdout=writing, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == code
        assert ("usage: " in done.stderr) is bool(code) and "Error" not in done.stderr
    os.close(writing)


def test_help_shows_the_flags_of_a_command_around_it(capsys) -> None:
    parent = argparse.ArgumentParser(add_help=False)
    parent.add_argument("--backend")
    with pytest.raises(SystemExit):
        choose_training(["--help"], {}, "node.py", "dqn", parent=parent)
    told = capsys.readouterr().out
    assert "--backend" in told and "--dueling" in told and "node.py" in told


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--env-id=CartPol-v1"], "can't make CartPol-v1: "),
        (["--env-kwargs=wheels=4"], "can't make CartPole-v1"),
        (["--train-env-kwargs=wheels=4"], "can't make CartPole-v1"),
        (["--eval-env-kwargs=wheels=4"], "can't make CartPole-v1"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("algorithm", [DQN, REINFORCE])
def test_an_environment_that_does_not_do_leaves_no_folder(
    capsys, tmp_path: Path, algorithm: list[str], arguments: list[str], words: str
) -> None:
    assert words in failed(capsys, *algorithm, *arguments, "--run-dir=run")
    assert not (tmp_path / "run").exists()


def test_a_device_that_is_not_there(capsys) -> None:
    assert "torch can't use the device 'cda': Expected" in failed(capsys, *DQN, "--device=cda")


def test_a_run_folder_in_use(capsys, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mine").write_text("")
    assert "isn't empty" in failed(capsys, *DQN, "--run-dir=run")
    assert (tmp_path / "run" / "mine").exists()


def test_what_cannot_be_resumed(capsys, tmp_path: Path) -> None:
    assert "is not a run folder" in refused(capsys, f"--resume={tmp_path}")
    assert main([*REINFORCE, "--run-dir=run"]) == 0
    with held(tmp_path / "run"):
        assert "a training is running in" in failed(capsys, "--resume=run")
    assert "--resume allows no --seed" in refused(capsys, "--resume=run", "--seed=1")
    line = refused(capsys, "--resume=run", "--algo=dqn")
    assert "run/config.json is of a training by reinforce, not by dqn" in line
    content = json.loads(Path("run/config.json").read_text())
    Path("run/config.json").write_text(json.dumps(content | {"algorithm": "pg"}))
    assert "unknown algorithm" in refused(capsys, "--resume=run")


def test_ctrl_c_before_the_training(capsys, monkeypatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "run_training", interrupted)
    assert failed(capsys, *DQN, code=130).endswith(": interrupted")
