"""Callbacks of the user's own: what they see, what they may break, and how they are named."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest
from support.training.training_runs import rows, small, summary

import rl_workbench
from rl_workbench import Callback, WorkbenchError, cli
from rl_workbench.starting import Interrupt
from rl_workbench.training.training import Training

MODULE = """
from rl_workbench import Callback

class Failing(Callback):
    def on_episode(self, training, episode):
        if episode.number == 3:
            raise ZeroDivisionError("no such luck")

class NoCallback:
    pass
"""


class Recorder(Callback):
    """Remembers each event."""

    def __init__(self) -> None:
        self.events: list[tuple[str, object]] = []

    def on_training_start(self, training) -> None:
        self.events.append(("start", training.steps))

    def on_step(self, training) -> None:
        self.events.append(("step", training.steps))

    def on_episode(self, training, episode) -> None:
        assert training.history.returns[-1] == episode.total_reward
        training.log.add(episode.step, {"mine/length": episode.length})
        self.events.append(("episode", episode.number))

    def on_evaluation(self, training, result) -> None:
        assert len(result.evaluation.returns) == training.options.run.eval_episodes
        self.events.append(("evaluation", result.step))

    def on_checkpoint(self, training, path) -> None:
        assert path.is_file() and path.is_relative_to(training.folder)
        self.events.append(("checkpoint", training.steps))

    def on_training_end(self, training) -> None:
        self.events.append(("end", training.steps))

    def of(self, name: str) -> list[object]:
        return [value for each, value in self.events if each == name]


def run(name: str, folder: Path, *callbacks: Callback) -> Path:
    folder.mkdir()
    Training(small(name), folder, Interrupt(), callbacks).run()
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dqn", "reinforce"])
def test_they_see_every_event_in_order(name: str, tmp_path: Path) -> None:
    seen = Recorder()
    told = summary(run(name, tmp_path / "run", seen))
    assert seen.events[0] == ("start", 0) and seen.events[-1] == ("end", told["steps"])
    assert seen.of("episode") == list(range(1, told["episodes"] + 1))
    assert seen.of("evaluation") == [step for step, _ in told["evaluations"]]
    assert seen.of("checkpoint")[0] == 0 and seen.of("checkpoint")[-1] == told["steps"]
    assert seen.of("step")[-1] == told["steps"]
    assert "mine/length" in (tmp_path / "run/scalars.csv").read_text()


@pytest.fixture
def module(tmp_path: Path, monkeypatch) -> str:
    (tmp_path / "my_callbacks.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "my_callbacks", raising=False)
    return "my_callbacks"


@pytest.mark.slow
def test_one_that_fails_ends_the_training_with_a_line(tmp_path: Path, module: str, capsys) -> None:
    folder = tmp_path / "run"
    flags = ["--total-timesteps=2000", "--eval-frequency=0", "--eval-episodes=1"]
    command = ["train", "--algo=dqn", f"--run-dir={folder}", *flags]
    assert cli.main([*command, f"--callback={module}:Failing"]) == 1
    (line,) = [each for each in capsys.readouterr().err.splitlines() if "callback" in each]
    assert "the callback Failing failed in on_episode(): ZeroDivisionError: no such luck" in line
    assert "my_callbacks.py:7" in line and "--resume" in line
    assert "ZeroDivisionError" in (folder / "failure.txt").read_text()
    assert cli.main(["train", f"--resume={folder}"]) == 0, "without it"
    assert summary(folder)["complete"]


@pytest.mark.slow
def test_a_loss_is_logged_at_the_step_at_which_one_fails(tmp_path: Path) -> None:
    class Late(Callback):
        def on_episode(self, training, episode) -> None:
            assert episode.step < 60, "by then it learns"

    options = small("dqn")
    options = options._replace(run=replace(options.run, log_frequency=1))
    with pytest.raises(WorkbenchError, match="Late failed"):
        Training(options, tmp_path, Interrupt(), [Late()]).run()
    end = str(summary(tmp_path)["steps"])
    assert (end, "losses/td_loss") in [row[:2] for row in rows(tmp_path)]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("my_callbacks", "must be module:name"),
        ("my_callback:Failing", "No module named 'my_callback'"),
        ("my_callbacks:Missing", "has no attribute 'Missing'"),
        ("my_callbacks:NoCallback", "must be a subclass of rl_workbench.Callback"),
    ],
)
@pytest.mark.usefixtures("module")
def test_names_of_none(name: str, words: str, tmp_path: Path, capsys) -> None:
    command = ["train", "--algo=dqn", f"--run-dir={tmp_path / 'run'}", f"--callback={name}"]
    assert cli.main(command) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line


def test_a_training_from_python(tmp_path: Path) -> None:
    seen = Recorder()
    folder = rl_workbench.train(
        "reinforce", [seen], env_id="CartPole-v1", episodes=3, run_dir=str(tmp_path / "run")
    )
    assert summary(folder)["episodes"] == 3 == len(seen.of("episode"))
    with pytest.raises(WorkbenchError, match="unknown parameter 'gama'; did you mean gamma"):
        rl_workbench.train("reinforce", gama=1)
