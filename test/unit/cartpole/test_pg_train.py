"""The commands that train: the robot's own options, and those of ROS."""

import json
from pathlib import Path
from typing import Any

import pytest

from cartpole import dqn_train, pg_train
from cartpole.pg_train import ENV_ID, RobotOptions, choose, main
from rl_workbench.training import train as cli
from rl_workbench.training.options import TrainingOptions

SHORT = ["--episodes=2", "--eval-episodes=1"]
PLAIN = ["--env-id=CartPole-v1", *SHORT]
BULLET = ["--backend=bullet", *SHORT]


@pytest.fixture(autouse=True)
def _no_master(monkeypatch, tmp_path: Path) -> None:
    """The command asks a master for parameters; what it writes goes below the working folder."""
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    monkeypatch.chdir(tmp_path)


def refused(capsys, *flags: str, **parameters: Any) -> str:
    with pytest.raises(SystemExit) as stop:
        choose(list(flags), parameters)
    assert stop.value.code == 2
    return capsys.readouterr().err


def failed(capsys, *flags: str) -> str:
    """Runs the command; returns its one line."""
    capsys.readouterr()
    assert main([*flags]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("pg_train.py: ")
    return lines[0]


# Options.


def test_without_flags_it_is_the_robot_by_reinforce() -> None:
    options, robot = choose([], {})
    assert (options.kind.name, options.run.env_id, robot) == ("reinforce", ENV_ID, RobotOptions())
    assert options.run.stop_at_length == 2400, "as its section of the configuration says"
    assert options.run.train_env_kwargs["backend"] in ("ros", "bullet")


def test_flags_of_the_robot_become_options_of_its_environment() -> None:
    flags = ["--episodes=5", "--seed=3", "--run-dir=out", "--save-every=2", "--rviz"]
    options, robot = choose([*flags, "--realtime", "--start-noise=0.05"], {})
    assert (options.run.episodes, options.run.seed, options.run.run_dir) == (5, 3, "out")
    assert options.hyperparameters.save_every == 2 and robot.rviz
    assert options.run.train_env_kwargs == {
        "backend": "ros-realtime", "control_period": 0.0, "noise": 0.05
    }  # fmt: skip
    options, _ = choose(["--backend=bullet", "--train-env-kwargs=max_steps=7"], {})
    assert options.run.train_env_kwargs == {"max_steps": 7, "backend": "bullet"}
    options, _ = choose(["--algo=reinforce-document", "--random-weights", "--stop-at-length=7"], {})
    assert options.hyperparameters.random_weights and options.run.stop_at_length == 7
    assert options.run.env_id == ENV_ID


def test_parameters_and_flags_over_them() -> None:
    parameters = {"episodes": 5, "seed": "3", "backend": "bullet", "start_noise": 0.05}
    options, robot = choose(["--episodes=7"], parameters)
    assert (options.run.episodes, options.run.seed) == (7, 3)
    assert robot == RobotOptions(backend="bullet", start_noise=0.05)
    empty = {"run_dir": "", "realtime": "", "gui": False, "resume": "", "config": "", "algo": ""}
    assert choose([], empty) == choose([], {})
    assert choose([], {"gui": True})[0].session.gui
    assert not choose(["--no-gui"], {"gui": True})[0].session.gui


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--start-noise=-0.1"], "start_noise must be between 0 and 0.2"),
        (["--start-noise=0.3"], "start_noise must be between"),
        (["--start-noise=nan"], "must be a number, not 'nan'"),
        (["--backend=gazebo"], "invalid choice: 'gazebo'"),
        (["--gui", "--headless"], "--headless: not with --gui"),
        (["--backend=bullet", "--rviz"], "not with --backend bullet"),
        (["--backend=bullet", "--realtime"], "not with --backend bullet"),
        (["--num-envs=2", "--realtime"], "--realtime is for a single simulator: num_envs must be"),
        (["--num-envs=2", "--rviz"], "--rviz is for a single simulator: num_envs must be 1, not 2"),
        (["--num-envs=2", "--algo=reinforce-document"], "learns in one environment: num_envs"),
        (["--episods=5"], "unknown flag '--episods'; did you mean --episodes?"),
    ],
)
def test_wrong_flags_exit_with_2_and_a_line(capsys, flags: list[str], words: str) -> None:
    told = refused(capsys, *flags)
    assert words in told and len(told.splitlines()) == 2


def test_wrong_parameters_too(capsys) -> None:
    assert "'episods'; did you mean episodes" in refused(capsys, episods=5)
    assert "realtime must be true or false, not 'maybe'" in refused(capsys, realtime="maybe")


@pytest.mark.parametrize("given", ["--backend=ros", "--start-noise=0.1", "--rviz", "--realtime"])
def test_what_is_the_robots_alone(capsys, given: str) -> None:
    flag = given.partition("=")[0]
    line = refused(capsys, "--env-id=X-v0", given)
    assert f"{flag} is for the cart-pole: not with --env-id X-v0" in line


@pytest.mark.parametrize("flag", ["--env-kwargs", "--train-env-kwargs"])
def test_a_backend_among_the_environments_options_counts(flag: str) -> None:
    options, _ = choose([flag, "backend=bullet", "--start-noise=0.1"], {})
    assert options.run.training_environment == {"backend": "bullet", "noise": 0.1}


# Trainings in this process.


@pytest.mark.slow
def test_the_robot_in_this_process_and_resumed(tmp_path: Path, capsys) -> None:
    assert main([*BULLET, "--exp-name=mine", "--start-noise=0.02"]) == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert run.name.startswith("cartpole-Balance-v0__mine__0__")
    record = json.loads((run / "config.json").read_text())
    assert record["run"]["train_env_kwargs"] == {"backend": "bullet", "noise": 0.02}
    assert main([f"--resume={run}", "--episodes=3"]) == 0
    assert "after episode 2 of 3" in capsys.readouterr().out
    assert "--resume allows no --backend" in refused(capsys, f"--resume={run}", "--backend=bullet")


@pytest.mark.slow
def test_another_environment(tmp_path: Path) -> None:
    private = ["_gamma:=0.5", "_batch_episodes:=2"]
    assert main([*PLAIN, "--run-dir=run", "--seed=5", *private]) == 0
    record = json.loads((tmp_path / "run/config.json").read_text())
    own = record["hyperparameters"]
    assert (own["gamma"], own["batch_episodes"], record["run"]["seed"]) == (0.5, 2, 5)


def test_an_environment_that_does_not_do(capsys, tmp_path: Path) -> None:
    swing_up = ["--env-id=cartpole/SwingUp-v0", "--backend=bullet", "--run-dir=run"]
    line = failed(capsys, *swing_up, "--algo=reinforce-document")  # reinforce learns in it
    assert "reinforce, or Stable-Baselines3's ppo" in line
    assert "Did you mean: `CartPole`?" in failed(capsys, "--env-id=CartPol-v1", "--run-dir=run")
    assert not (tmp_path / "run").exists()


def test_ctrl_c_before_the_training(capsys, monkeypatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(pg_train, "run_training", interrupted)
    assert main(BULLET) == 130
    assert capsys.readouterr().err == "pg_train.py: interrupted\n"


def test_private_parameters_of_dqn_train(monkeypatch) -> None:
    """As every node takes them: rosrun cartpole dqn_train.py _gamma:=0.5."""
    chosen: list[TrainingOptions] = []
    monkeypatch.setattr(cli, "run_training", lambda options, *_, **__: chosen.append(options))
    assert dqn_train.main(["_gamma:=0.5", "--seed=3", "_seed:=4", "_dueling:=true"]) == 0
    (options,) = chosen
    assert (options.kind.name, options.run.seed) == ("dqn", 3)
    assert (options.hyperparameters.gamma, options.hyperparameters.dueling) == (0.5, True)


def test_rviz_where_it_cannot_be_is_one_line(monkeypatch, tmp_path, capsys):
    """Before anything is started."""
    pytest.importorskip("rospy")
    monkeypatch.chdir(tmp_path)
    for program, display, text in (
        (None, ":0", "RViz isn't installed: ./ws rviz"),
        ("/usr/bin/rviz", "", "RViz needs a display to open a window on, and DISPLAY isn't set"),
    ):
        monkeypatch.setattr("shutil.which", lambda name, program=program: program)
        monkeypatch.setenv("DISPLAY", display)
        assert pg_train.main(["--rviz", "--backend", "ros"]) == 1
        assert capsys.readouterr().err.strip().splitlines()[-1].startswith(f"pg_train.py: {text}")
    assert list(tmp_path.glob("runs/*")) == []


@pytest.mark.slow
def test_a_master_that_does_not_answer_or_can_not_be_reached_or_named(
    nobody_answers, capsys, monkeypatch
) -> None:
    pytest.importorskip("rospy")
    for master, reason in (
        (nobody_answers, "no answer within"),
        # 192.0.2.0/24 is reserved for documentation: nobody answers there.
        ("http://192.0.2.1:11311", "no ROS master at http://192.0.2.1:11311"),
        ("nonsense", "nonsense"),
    ):
        monkeypatch.setenv("ROS_MASTER_URI", master)
        assert reason in failed(capsys, "--run-dir=run")
    assert not Path("run").exists()
