"""kill -9 of trainings at random moments: resumed, each ends as if nothing had been."""

import random
from collections.abc import Callable
from pathlib import Path

import pytest
from stress.scenario import Scenario
from stress.trainings import forked, new, random_moment
from training_runs import assert_no_doubles, assert_same_run, summary

KILLS = 3  # of one training
full = pytest.mark.stress(full=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The same training, never killed."""
    folder = tmp_path_factory.mktemp("whole")

    def run(name: str) -> Path:
        with forked(new(name, folder / name / "run"), folder / name) as training:
            training.ended()
        return folder / name / "run"

    return run


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("dqn", marks=pytest.mark.stress),
        pytest.param("reinforce", marks=full),
        pytest.param("reinforce-document", marks=full),
        pytest.param("ppo", marks=[full, pytest.mark.extras("stable_baselines3")]),
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
        if name == "ppo":  # comes to other bits after a --resume
            assert set(summary(run)) == set(summary(unharmed))
        else:
            assert_same_run(unharmed, run)

    row = scenario.run(f"kill -9 of a training, resumed: {name}", 20, case, lanes=2, unit=KILLS)
    row.notes.append(f"{sum(killed)} before its end")
    assert any(killed)
