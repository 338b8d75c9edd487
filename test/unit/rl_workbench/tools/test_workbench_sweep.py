"""The search for options: ranges, trials that fail, a study that is gone on with."""

import json
import signal
from pathlib import Path
from typing import Any

import pytest
import yaml

from rl_workbench import cli
from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.sweep.ranges import Range, read_ranges
from rl_workbench.tools.sweep.sweep import Sweep, run_sweep
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options.training_options import known_options
from rl_workbench.training.run.interrupt import Interrupt

pytestmark = [pytest.mark.usefixtures("signals"), pytest.mark.extras("optuna", "stable_baselines3")]
RANGES = {"x": Range(-10.0, 10.0, False, ()), "kind": Range(0, 0, False, ("a", "b"))}


def sweep(folder: Path, trials: int, seeds: int = 1) -> Sweep:
    folder.mkdir(exist_ok=True)
    return Sweep(folder, "Some-v0", RANGES, trials, seeds, 0)


def parabola(values: dict[str, Any], folder: Path, seed: int, interrupt: Interrupt) -> float:
    return seed - (values["x"] - 3.0) ** 2


def trials(folder: Path) -> list[dict[str, Any]]:
    return json.loads((folder / "trials.json").read_text())


def test_it_finds_the_best_and_writes_it_down(tmp_path: Path) -> None:
    run_sweep(sweep(tmp_path, 40), parabola, Interrupt())
    best = yaml.safe_load((tmp_path / "best.yaml").read_text())["Some-v0"]
    assert best["x"] == pytest.approx(3.0, abs=1.5)
    assert len(trials(tmp_path)) == 40


def test_a_study_is_gone_on_with(tmp_path: Path) -> None:
    run_sweep(sweep(tmp_path, 3), parabola, Interrupt())
    run_sweep(sweep(tmp_path, 5), parabola, Interrupt())
    found = trials(tmp_path)
    assert len(found) == 5 and len({row["options"]["x"] for row in found}) == 5
    run_sweep(sweep(tmp_path, 5), parabola, Interrupt())
    assert len(trials(tmp_path)) == 5


def test_the_score_is_the_mean_over_seeds(tmp_path: Path) -> None:
    run_sweep(sweep(tmp_path, 1, seeds=3), parabola, Interrupt())
    (row,) = trials(tmp_path)
    assert row["score"] == pytest.approx(1.0 - (row["options"]["x"] - 3.0) ** 2)


def test_a_trial_that_fails_costs_no_other(tmp_path: Path) -> None:
    def train(values: dict, folder: Path, seed: int, interrupt: Interrupt) -> float:
        if folder.name.startswith("trial_0001"):
            raise WorkbenchError("the loss is nan")
        return 1.0

    run_sweep(sweep(tmp_path, 3), train, Interrupt())
    assert [row["state"] for row in trials(tmp_path)] == ["complete", "fail", "complete"]
    assert trials(tmp_path)[1]["failure"] == "the loss is nan"


def test_an_interrupted_trial_isnt_counted(tmp_path: Path) -> None:
    interrupt = Interrupt()

    def train(values: dict, folder: Path, seed: int, stop: Interrupt) -> float:
        if folder.name.startswith("trial_0001"):
            stop.signal = signal.SIGINT
        return 1.0

    run_sweep(sweep(tmp_path, 4), train, interrupt)
    assert [row["state"] for row in trials(tmp_path)] == ["complete", "fail"]
    run_sweep(sweep(tmp_path, 4), parabola, Interrupt())
    assert sum(row["state"] == "complete" for row in trials(tmp_path)) == 4


def test_a_damaged_study(tmp_path: Path) -> None:
    (tmp_path / "study.db").write_bytes(b"no database" * 100)
    with pytest.raises(WorkbenchError, match="isn't a study"):
        run_sweep(sweep(tmp_path, 1), parabola, Interrupt())


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("dqn: {learning_rat: {low: 0, high: 1}}", "did you mean learning_rate"),
        ("dqn: {gamma: 0.9}", "needs low and high, or choices"),
        ("dqn: {gamma: {low: 1, high: 0}}", "low <= high"),
        ("dqn: {gamma: {low: 0, high: 1, log: true}}", "begins above 0"),
        ("dqn: {gamma: {lowest: 0}}", "did you mean low"),
        ("dqn: {gamma: {choices: []}}", "choices are a list"),
        ("dqn: {hidden_sizes: {choices: [[64, 64]]}}", "sizes are a text"),
        ("ppo: {gamma: {choices: [1]}}", "has no section 'dqn'"),
    ],
)
def test_wrong_ranges(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(WorkbenchError, match=told):
        read_ranges(
            tmp_path / "a.yaml", "dqn", "CartPole-v1", known_options(ALGORITHMS["dqn"]).names
        )


@pytest.mark.parametrize("algorithm", ["dqn", "ppo", "sac"])
def test_the_packages_own_ranges(algorithm: str) -> None:
    assert read_ranges(None, algorithm, "Any-v0", known_options(ALGORITHMS[algorithm]).names)


@pytest.mark.parametrize("algorithm", ["dqn", "reinforce", "ppo"])
def test_the_command_trains_and_its_best_options_can_be_used(
    tmp_path: Path, algorithm: str, capsys
) -> None:
    ranges = tmp_path / "ranges.yaml"
    ranges.write_text(
        "dqn: {gamma: {choices: [0.98, 0.99]}, eval_frequency: {choices: [200]}, "
        "confirm_episodes: {choices: [2]}}\n"
        "ppo: {gamma: {choices: [0.98]}, n_steps: {choices: [64]}, eval_frequency: {choices: [64]}}\n"
        "reinforce: {gamma: {choices: [0.98]}, batch_episodes: {choices: [1, 2]}}"
    )
    flags = ["sweep", "--algo", algorithm, "--out", str(tmp_path / "study"), "--trials", "2",
             "--ranges", str(ranges), "--total-timesteps", "200"]  # fmt: skip
    assert cli.main(flags) == 0
    assert len(trials(tmp_path / "study")) == 2
    assert "its options are in" in capsys.readouterr().out
    best = yaml.safe_load((tmp_path / "study" / "best.yaml").read_text())
    assert list(best) == ["ppo CartPole-v1" if algorithm == "ppo" else "CartPole-v1"]
