"""kill -9 of trainings at random moments: once resumed, each ends as if never killed."""

import contextlib
import os
import random
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from support.stress.places import place, waits
from support.stress.scenario import Scenario
from support.stress.trainings import BOUND, forked, new, random_moment
from support.training.training_runs import assert_no_doubles, assert_same_run, summary

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


VICTIMS = ("pg_train.py", "/gzserver ", "")  # the training, its simulator, all there is
OVER_ROS = [
    *("--backend=ros", "--start-noise=0.05", "--episodes=40", "--eval-episodes=1"),
    *("--checkpoint-frequency=60", "--stop-at-length=0"),
]


@full
def test_killed_over_ros(scenario: Scenario) -> None:
    """The training finds the simulator that it has lost, or starts another one: the bits are the same."""
    with place() as unharmed:
        training = unharmed.train(*OVER_ROS)
        assert training.end(BOUND) == 0, training.output

        def case(number: int, dice: random.Random) -> None:
            victim = VICTIMS[number % len(VICTIMS)]
            with place() as here:
                training = here.train(*OVER_ROS)
                assert waits((here.run / "last.pt").exists), training.output
                time.sleep(dice.uniform(0.0, 2.0))
                for pid, command in here.processes().items():
                    if victim in command:
                        with contextlib.suppress(ProcessLookupError):
                            os.kill(pid, signal.SIGKILL)
                training.end(BOUND)
                assert "Traceback" not in training.output, training.output
                resumed = here.start("rosrun", "cartpole", "pg_train.py", f"--resume={here.run}")
                assert resumed.end(BOUND) == 0, resumed.output
                assert "Traceback" not in resumed.output, resumed.output
                assert_same_run(unharmed.run, here.run)
                assert_no_doubles(here.run)

        scenario.run("kill -9 over ROS, resumed", 50, case, lanes=2)
