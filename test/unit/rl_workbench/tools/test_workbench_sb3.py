"""The commands of rl-workbench on trainings with Stable-Baselines3."""

from pathlib import Path

import pytest
from support.training import workbench_runs

from rl_workbench import cli

pytestmark = pytest.mark.extras("stable_baselines3")


@pytest.fixture(scope="module")
def ppo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return workbench_runs.sb3(tmp_path_factory.mktemp("sb3") / "run", num_envs=2)


def work(*arguments: object) -> int:
    return cli.main([str(each) for each in arguments])


def test_the_other_commands_take_it(ppo: Path, tmp_path: Path) -> None:
    assert work("eval", ppo, "--episodes", 2, "--checkpoint", "last") == 0
    assert work("record", ppo, "--out", tmp_path / "a.gif", "--max-steps", 10) == 0
    assert work("plot", ppo, "--out", tmp_path / "a.png") == 0
    assert work("compare", ppo, "--episodes", 1, "--out", tmp_path / "c.png") == 0


def test_many_environments_of_training_are_one_when_playing(tmp_path: Path, recwarn) -> None:
    run = workbench_runs.sb3(tmp_path / "run", num_envs=8, n_steps=1, batch_size=8)
    recwarn.clear()
    assert work("eval", run, "--episodes", 1) == 0
    assert not [each for each in recwarn if "mini-batch" in str(each.message)]
