"""Every signal at random moments: a resumable end or none, no process left, no traceback."""

import random
import resource
import shlex
import signal
import sys
import time
from pathlib import Path

import pytest
from support.ros.programs import NETWORKS
from support.stress.places import ended, launch, leftovers, no_traceback, pid_of, place, send, waits
from support.stress.scenario import Scenario
from support.stress.trainings import BOUND, forked, new, wait_for_newer_checkpoint
from support.training.training_runs import assert_no_doubles, assert_same_run, summary

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU)  # it saves, and ends
ROSLAUNCHS = ENDING[:3]  # it ends its nodes
FATAL = (signal.SIGQUIT, signal.SIGUSR1)  # nobody listens to them: it ends, as after kill -9
HARMLESS = (signal.SIGPIPE, signal.SIGSTOP, signal.SIGWINCH)  # it goes on
SIGNALS = [*ENDING, *FATAL, *HARMLESS]
NO_CORE = {resource.RLIMIT_CORE: 0}  # SIGQUIT leaves no picture of the memory
full = pytest.mark.stress(full=True)


@pytest.mark.parametrize(
    "name", [pytest.param("dqn", marks=full), pytest.param("reinforce", marks=pytest.mark.stress)]
)
def test_to_a_training(scenario: Scenario, whole, tmp_path: Path, name: str) -> None:
    unharmed = whole(name)

    def case(number: int, dice: random.Random) -> None:
        run, sent = tmp_path / str(number) / "run", SIGNALS[number % len(SIGNALS)]
        with forked(new(name, run), run.parent, NO_CORE) as training:
            for _ in range(dice.randint(1, 6)):
                wait_for_newer_checkpoint(run, training.is_running)
            time.sleep(dice.uniform(0.0, 0.2))
            ran = training.is_running()
            send(training.pid, sent, dice)
            if sent in FATAL and ran:
                assert training.code() in (-sent, 0), training.output
            elif sent in ENDING and training.code() == 128 + sent:
                assert f"--resume {shlex.quote(str(run))} continues" in training.ended(128 + sent)
                assert summary(run)["interrupted"]
            else:
                training.ended()
        with forked(["--resume", str(run)], run.parent) as training:
            training.ended()
        assert_no_doubles(run)
        assert_same_run(unharmed, run)

    scenario.run(f"signals to a training, resumed: {name}", 40, case, lanes=2)


@pytest.mark.stress
def test_to_a_training_that_starts(scenario: Scenario) -> None:
    """The command itself, from its first instruction on."""

    def case(number: int, dice: random.Random) -> None:
        sent = ENDING[number % len(ENDING)]
        with place() as here:
            options = new("dqn", here.run)
            training = here.start(sys.executable, "-m", "rl_workbench", "train", *options)
            time.sleep(dice.uniform(0.3, 4.0))  # Python itself has started by then, mostly
            send(training.pid, sent, dice)
            code = training.end(BOUND)
            assert code in (-sent, 128 + sent, 0), training.output
            no_traceback(training.output)
            if here.run.exists():
                assert code == 0 or (here.run / "last.pt").exists(), here.files()

    scenario.run("signals to a training that starts", 30, case, lanes=2)


@full
def test_to_a_training_over_ros(scenario: Scenario) -> None:
    """Of the process group, as a terminal sends them: simulator and master have sessions of their own."""

    def case(number: int, dice: random.Random) -> None:
        sent = ENDING[number % len(ENDING)]
        with place() as here:
            training = here.train("--episodes=100000", "--stop-at-length=0", "--backend=ros")
            time.sleep(dice.uniform(0.5, 15.0))
            send(training.pid, sent, dice)
            code = training.end(BOUND)
            assert code in (-sent, 128 + sent), training.output
            no_traceback(training.output)
            left = here.left_after(60)
            assert not left, left
            if here.run.exists():
                assert here.files() >= NETWORKS, here.files()
                assert summary(here.run)["interrupted"]

    scenario.run("signals to a training over ROS", 12, case)


@pytest.mark.stress
def test_to_roslaunch(scenario: Scenario) -> None:
    def case(number: int, dice: random.Random) -> None:
        with place() as here:
            launched = launch(here)
            launched.wait_for("SUMMARY", BOUND)
            time.sleep(dice.uniform(0.0, 6.0))
            launched.send(ROSLAUNCHS[number % len(ROSLAUNCHS)])
            ended(launched, here)
            no_traceback(launched.output)
            assert not leftovers(here), leftovers(here)

    scenario.run("signals to roslaunch with a simulator", 18, case, lanes=2)


@full
def test_to_a_simulator(scenario: Scenario) -> None:
    def case(number: int, dice: random.Random) -> None:
        sent = SIGNALS[number % len(SIGNALS)]
        with place() as here:
            launched = launch(here)
            simulator = pid_of(here, "/gzserver ")
            time.sleep(dice.uniform(0.5, 6.0))
            send(simulator, sent, dice)
            if sent not in HARMLESS:
                assert waits(lambda: simulator not in here.processes()), "it lives on"
            else:
                waits(lambda: False, 1.0)
                assert simulator in here.processes(), launched.output
            launched.send(signal.SIGINT)
            ended(launched, here)
            no_traceback(launched.output)
            assert sent in FATAL or not leftovers(here), leftovers(here)

    scenario.run("signals to a simulator", 24, case, lanes=2)
