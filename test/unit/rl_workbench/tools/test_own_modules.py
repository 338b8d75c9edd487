"""Environments of a module of one's own, `module:namespace/Name-v0`, with a goal, in every command."""

import json
import os
import sys
from pathlib import Path

import pytest
from PIL import Image
from support.training.workbench_runs import work

import rl_workbench
from rl_workbench import cli
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.train import choose

pytestmark = pytest.mark.slow

ENV_ID = "own_arm.tasks:own_arm/Reach-v0"
MODULE = """
import gymnasium
from support.training.goal_environments import Reach

gymnasium.register("own_arm/Reach-v0", Reach, reward_threshold=-7.5)
"""
SMALL = ["--env-id", ENV_ID, "--env-kwargs", "moves=4", "--total-timesteps=300", "--eval-episodes=2",
         "--eval-frequency=100", "--confirm-episodes=0", "--learning-starts=50"]  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def module(tmp_path_factory: pytest.TempPathFactory):
    """A package of the user's, found as `ws --with FOLDER` has it found, also by other processes."""
    folder = tmp_path_factory.mktemp("with")
    (folder / "own_arm").mkdir()
    (folder / "own_arm/__init__.py").touch()
    (folder / "own_arm/tasks.py").write_text(MODULE)
    tests = Path(__file__).resolve().parents[3]
    source = Path(rl_workbench.__file__).parents[1]
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        known = os.environ.get("PYTHONPATH", "")
        patch.setenv("PYTHONPATH", f"{folder}:{tests}:{source}:{known}")
        yield folder


@pytest.fixture(scope="module")
def trained(module: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "run"
    assert cli.main(["train", "--algo", "dqn", *SMALL, "--run-dir", str(folder)]) == 0
    return folder


def test_eval_knows_the_line_and_the_successes(trained: Path, capsys) -> None:
    assert cli.main(["eval", str(trained), "--episodes", "3", "--json", "-"]) == 0
    told = capsys.readouterr()
    found = json.loads(told.out)
    assert found["solved"] is (found["mean"] >= -7.5)
    assert len(found["successes"]) == 3
    assert found["success_rate"] == sum(found["successes"]) / 3
    assert "success |" not in told.err and f"success {found['success_rate']:.0%}" in told.err
    assert told.err.splitlines()[0].endswith(("| success", "| no success"))


def test_plot_and_compare(trained: Path, tmp_path: Path, capsys) -> None:
    figures, pictures = tmp_path / "figures.json", []
    for over in ("episodes", "steps"):
        pictures.append(tmp_path / f"{over}.png")
        assert work("plot", trained, "--out", pictures[-1], "--over", over) == 0
    pictures.append(tmp_path / "seeds.png")
    wanted = ["--episodes", "3", "--json", figures, "--out", pictures[-1]]
    capsys.readouterr()
    assert work("compare", trained, *wanted) == 0
    (group,) = json.loads(figures.read_text())["groups"].values()
    assert group["runs"][0]["success"] in (0.0, 1 / 3, 2 / 3, 1.0)
    head, _, row, *_ = capsys.readouterr().out.splitlines()
    assert "| success |" in head and "%" in row
    for picture in map(Image.open, pictures):
        assert picture.width > 2 * picture.height, "returns and successes, side by side"


def test_benchmark_trains_in_processes_of_their_own(tmp_path: Path, monkeypatch, capsys) -> None:
    """They find the modules that this one finds, and no others in the current folder."""
    monkeypatch.chdir(tmp_path)
    for name in ("token", "random", "queue"):  # of the standard library
        (tmp_path / f"{name}.py").write_text("raise SystemExit('not the standard library')\n")
    monkeypatch.delenv("PYTHONPATH")
    options = ["env_kwargs=moves=4", "total_timesteps=200", "learning_starts=50", "eval_frequency=0",
               "confirm_episodes=0", "eval_episodes=1"]  # fmt: skip
    wanted = ["--seeds", "1", "--episodes", "2", "--out", str(tmp_path / "out")]
    command = ["benchmark", "--env-id", ENV_ID, "--params", *options, *wanted]
    assert cli.main(command) == 0
    table = (tmp_path / "out/results.md").read_text()
    assert "| success |" in table and "0 of 1" in table and "at least -7.5." in table


@pytest.mark.parametrize("section", [ENV_ID, "own_arm/Reach-v0"])
def test_a_section_of_options_is_found_by_either_name(tmp_path: Path, section: str) -> None:
    config = tmp_path / "options.yaml"
    config.write_text(f"{section}: {{gamma: 0.25}}\nother: {{gamma: 0.5}}\n")
    options = choose(ALGORITHMS["dqn"], [f"--config={config}", f"--env-id={ENV_ID}"])
    assert options.hyperparameters.gamma == 0.25


@pytest.mark.parametrize(
    ("env_id", "words"),
    [
        ("own_arm/Reech-v0", "Did you mean: `Reach`? One of your own is named with its module, as in "),
        ("zzz/yyy", "can't make zzz/yyy: Namespace zzz not found."),
        ("own_arm.tasks:own_arm/Reech-v0", "Did you mean: `Reach`?"),
        ("own_arm.task:own_arm/Reach-v0", "there is no module 'own_arm.task'; "),
        ("own_amr.tasks:own_arm/Reach-v0", "there is no module 'own_amr'; "),
        ("own_arm.broken:own_arm/Reach-v0", "ZeroDivisionError: division by zero (", ),
        ("own_arm.needy:own_arm/Reach-v0", "ModuleNotFoundError: No module named 'nowhere' ("),
        ("own_arm.leaving:own_arm/Reach-v0", "can't make own_arm.leaving:own_arm/Reach-v0: SystemExit"),
    ],
)  # fmt: skip
def test_a_name_that_leads_nowhere_is_one_line(module, tmp_path, capsys, env_id, words) -> None:
    (module / "own_arm/broken.py").write_text("1 / 0\n")
    (module / "own_arm/needy.py").write_text("import nowhere\n")
    (module / "own_arm/leaving.py").write_text("raise SystemExit\n")
    __import__("own_arm.tasks")
    wanted = ["--env-id", env_id, "--run-dir", str(tmp_path / "run")]
    assert cli.main(["train", "--algo", "dqn", *wanted]) == 1
    told = capsys.readouterr().err
    assert words in told and told.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_a_run_without_module_is_plotted(module, trained, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(sys, "path", [each for each in sys.path if each != str(module)])
    for name in ("own_arm", "own_arm.tasks"):
        monkeypatch.delitem(sys.modules, name)
    assert cli.main(["plot", str(trained), "--out", str(tmp_path / "curve.png")]) == 0
    for needs_it in ("eval", "eval --checkpoint=random", "view --no-browser", "enjoy"):
        capsys.readouterr()
        assert cli.main([*needs_it.split(), str(trained)]) == 1
        told = capsys.readouterr()
        assert told.out == "" and told.err.count("\n") == 1
        assert "there is no module 'own_arm'" in told.err
