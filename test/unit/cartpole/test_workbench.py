"""workbench.py: rl_workbench's command line, which knows the cart-pole and roslaunch's arguments."""

import json
import os
import shlex
import subprocess
from pathlib import Path

import pytest
from support.training import workbench_runs

from cartpole import workbench
from cartpole.workbench import PROGRAM, main
from rl_workbench import errors
from rl_workbench.starting import JOB


def test_the_cart_pole_is_known_and_roslaunchs_arguments_are_left_out(tmp_path, capsys) -> None:
    robot = {"env_id": "cartpole/Classic-v0", "total_timesteps": 100, "eval_frequency": 0}
    run = workbench_runs.dqn(tmp_path / "run", **robot)
    capsys.readouterr()
    extra = ["__name:=workbench", "__log:=workbench.log"]
    assert main(["eval", str(run), "--episodes=1", "--json=-", *extra]) == 0
    assert len(json.loads(capsys.readouterr().out)["returns"]) == 1


def test_no_free_port_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(JOB, "1")
    monkeypatch.setattr(workbench, "MASTER_PORTS", range(0))
    with pytest.raises(SystemExit, match="^workbench.py: no port is free"):
        main(["--help"])


@pytest.mark.slow
def test_its_trainings_in_processes_of_their_own_know_the_cart_pole(tmp_path: Path) -> None:
    flags = ["--algo=dqn", "--env-id=cartpole/Classic-v0", "--total-timesteps=50",
             "--eval-episodes=1", f"--run-dir={tmp_path / 'run'}"]  # fmt: skip
    subprocess.run([*PROGRAM, "train", *flags], check=True, timeout=120)
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["complete"]


def test_each_of_several_trainings_has_a_master_of_its_own(monkeypatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:11311")
    with pytest.raises(SystemExit):
        main(["--help"])
    assert os.environ["ROS_MASTER_URI"] == "http://127.0.0.1:11311"
    monkeypatch.setenv(JOB, "1")
    with pytest.raises(SystemExit):
        main(["--help"])
    assert 30000 <= int(os.environ["ROS_MASTER_URI"].removeprefix("http://127.0.0.1:")) < 32768


def test_recommended_commands_go_by_way_of_ws(root: Path, tmp_path: Path, monkeypatch) -> None:
    """With the folders that the user gave to --with; ws names one with a space by a link."""
    for name in ("mine", "other arm"):
        (tmp_path / name).mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "other arm")
    monkeypatch.setenv("CARTPOLE_WITH", f"{tmp_path}/mine:{tmp_path}/link")
    monkeypatch.setenv("CARTPOLE_WS", f"{root}/ws")
    monkeypatch.setattr(errors, "hints", errors.hints)
    with pytest.raises(SystemExit):
        main(["--help"])
    hints = errors.hints
    folders = f"--with {tmp_path}/mine --with '{tmp_path}/other arm'"
    command = f"{root}/ws {folders} rosrun cartpole workbench.py"
    assert shlex.join(hints.workbench) == command
    assert shlex.join(hints.tensorboard) == f"{root}/ws tensorboard"
    assert hints.extras == f"{root}/ws extras"
    done = subprocess.run(
        [root / "ws", "tensorboard", "--version_tb"], capture_output=True, text=True, check=True
    )
    assert done.stdout.split()[-1][0].isdigit(), done.stdout
