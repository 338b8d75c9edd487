"""Options by the names of earlier versions: refused, with the name of today, wherever they stand."""

from pathlib import Path

import pytest

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.cli import choose_training
from rl_workbench.training.options.training_options import choose
from rl_workbench.training.pg.kind import REINFORCE

STOP = "stop_at is called stop_at_length now"


def test_as_a_parameter(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match=f"^rosparam: the parameter {STOP}$"):
        choose(REINFORCE, [], {"stop_at": 5})
    with pytest.raises(
        WorkbenchError, match="^rosparam: the parameter algorithm is called algo now$"
    ):
        choose_training([], {"algorithm": "gae"}, default="reinforce")
    with pytest.raises(WorkbenchError, match=f"^--params: the option {STOP}$"):
        choose(REINFORCE, ["--params", "stop_at=5"])


def test_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("stop_at: 5\n")
    with pytest.raises(WorkbenchError, match=f"own.yaml: the option {STOP}$"):
        choose(REINFORCE, [f"--config={tmp_path / 'own.yaml'}"])


@pytest.mark.parametrize("flags", [["--algorithm=gae"], ["--algorithm", "gae", "--seed=1"]])
def test_the_algorithms_flag_alone(capsys, flags: list[str]) -> None:
    with pytest.raises(SystemExit):
        choose_training(flags)
    assert "--algorithm is called --algo now" in capsys.readouterr().err


@pytest.mark.extras("stable_baselines3")
def test_several_environments(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("n_envs: 8\n")
    with pytest.raises(WorkbenchError, match="the option n_envs is called num_envs now$"):
        choose(algorithm("ppo"), [f"--config={tmp_path / 'own.yaml'}"])


def test_names_that_are_only_wrong_are_told_by_the_nearest() -> None:
    with pytest.raises(WorkbenchError, match="unknown parameter 'gama'; did you mean gamma?"):
        choose(REINFORCE, [], {"gama": 5})
