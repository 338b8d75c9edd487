"""kill -9 of trainings at random moments: once resumed, each ends as if never killed."""

import random
from pathlib import Path

import pytest
from support.stress.scenario import Scenario
from support.stress.trainings import forked, new, random_moment
from support.training.training_runs import assert_no_doubles, assert_same_run, summary

KILLS = 3  # of one training
full = pytest.mark.stress(full=True)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("dqn", marks=full),  # a few: test_killed.py
        pytest.param("reinforce", marks=full),
        pytest.param("reinforce-document", marks=full),
        pytest.param("ppo", marks=[full, pytest.mark.extras("stable_baselines3")]),
        pytest.param("sac", marks=[full, pytest.mark.extras("stable_baselines3")]),
    ],
)
def test_killed_and_resumed(scenario: Scenario, whole, tmp_path: Path, name: str) -> None:
    unharmed = whole(name)
    killed: list[bool] = []  # whether it ran, then

    def case(number: int, dice: random.Random) -> None:
        run = tmp_path / str(number) / "run"
        arguments = new(name, run)
        for _ in range(KILLS):
            with forked(arguments, run.parent) as training:
                random_moment(dice, run, training)
                killed.append(training.kill())
            # Killed before it has written what it is, it is begun anew in the same folder.
            if (run / "config.json").exists():
                arguments = ["--resume", str(run)]
        with forked(arguments, run.parent) as training:
            told = training.ended()
        assert summary(run)["complete"], told
        assert_no_doubles(run)
        assert_same_run(unharmed, run)

    row = scenario.run(f"kill -9 of a training, resumed: {name}", 20, case, lanes=2, unit=KILLS)
    row.notes.append(f"{sum(killed)} before its end")
    assert any(killed)
