"""Interrupted anywhere and resumed: a training ends with the bits with which it would have ended."""

import hashlib
import shutil
import sys
from pathlib import Path

import pytest
from support.training import training_runs as runs
from support.training.goal_environments import Reach
from support.training.learning_fakes import Dicing, OnlyOne, register_with
from support.training.training_runs import EXACT, assert_same_run, checkpoint, resume, rows, train

from rl_workbench.training import checkpoints as run_checkpoints
from rl_workbench.training import training
from rl_workbench.training.checked import CheckedEnvironment
from rl_workbench.training.checkpoints import Checkpoints
from rl_workbench.training.environments import source_digest
from rl_workbench.training.evaluator import Evaluator

pytestmark = pytest.mark.slow


class Killed(Exception):
    """Nobody catches it, as nobody catches kill -9."""


@pytest.mark.parametrize("share", [0.0, 0.004, 0.22, 0.6, 0.97])
@pytest.mark.parametrize("name", EXACT)
def test_ctrl_c_anywhere_and_resumed_is_the_same(whole, times, tmp_path, name, share) -> None:
    interrupt = runs.InterruptAfter(1 + round(share * times(name)))
    run = train(tmp_path / "run", name, interrupt)
    assert interrupt.exit_code == 130
    assert runs.summary(run)["interrupted"]
    assert_same_run(whole(name), resume(run))
    runs.assert_no_doubles(run)


@pytest.mark.parametrize("name", EXACT)
def test_ctrl_c_in_an_evaluation(whole, tmp_path: Path, name: str) -> None:
    class InEvaluation(runs.InterruptAfter):
        def requested(self) -> bool:
            names, frame = set(), sys._getframe(1)
            while frame:
                names.add(frame.f_code.co_name)
                frame = frame.f_back
            return super().requested() if "run_greedily" in names else self.signal is not None

    run = train(tmp_path / "run", name, InEvaluation(25))
    assert runs.summary(run)["interrupted"]
    assert_same_run(whole(name), resume(run))


@pytest.mark.parametrize(
    ("name", "kind", "given", "moments"),
    [
        *((name, kind, None, (37, 60)) for name in EXACT[1:] for kind in (Dicing, OnlyOne)),
        ("reinforce", Reach, {"dense": True}, (50, 190)),  # with continuous actions
    ],
)
def test_whatever_generator_an_environment_draws_from_comes_back(
    tmp_path: Path, monkeypatch, name: str, kind: type, given: dict | None, moments: tuple
) -> None:
    options = {"env_id": register_with(monkeypatch, kind), "env_kwargs": given}
    whole = train(tmp_path / "whole", name, **options)
    for asked in moments:
        run = train(tmp_path / str(asked), name, runs.InterruptAfter(asked), **options)
        assert rows(run) != rows(whole), "interrupted"
        assert_same_run(whole, resume(run))


@pytest.mark.parametrize("name", EXACT)
def test_resuming_a_complete_training_changes_nothing(whole, tmp_path: Path, name: str) -> None:
    run = Path(shutil.copytree(whole(name), tmp_path / "run"))
    assert_same_run(whole(name), resume(run))


@pytest.mark.parametrize("name", EXACT)
def test_a_complete_training_prolonged_is_a_longer_one(tmp_path: Path, name: str) -> None:
    unit = "total_timesteps" if name == "dqn" else "episodes"
    longer, constant = {unit: runs.small(name).record()["run"][unit]}, {}
    if name == "dqn":
        constant = {"lr_schedule": "constant", "exploration_fraction": 0}
    whole = train(tmp_path / "whole", name, **constant)
    shorter = {unit: longer[unit] // 2}
    run = train(tmp_path / "run", name, **constant, **shorter)
    began = runs.record(run)["began"]
    resume(run, runs.InterruptAfter(40), **longer)
    assert not runs.summary(run)["complete"]
    resume(run)
    assert runs.summary(run)["complete"] and runs.record(run)["run"][unit] == longer[unit]
    assert runs.record(run)["began"] == began
    assert rows(run) == rows(whole)
    mine, other = checkpoint(run), checkpoint(whole)
    runs.assert_same(mine, other)


@pytest.mark.parametrize("name", EXACT)
def test_the_best_of_a_changed_task_is_evaluated_again(tmp_path, monkeypatch, capsys, name) -> None:
    interrupt = runs.InterruptAfter(1)
    run = train(tmp_path / "run", name)
    best = checkpoint(run, "best.pt")
    step_of_best, score = best.get("best_at_the_end", best["history"]["best"])
    step = CheckedEnvironment.step

    def halved(env: CheckedEnvironment, action: object) -> tuple:
        seen, reward, *rest = step(env, action)
        return seen, reward / 2, *rest

    monkeypatch.setattr(CheckedEnvironment, "step", halved)
    assert resume(run, interrupt) and "evaluated again" not in capsys.readouterr().out
    before = runs.record(run)["task"]
    monkeypatch.setattr(training, "source_digest", lambda env: "another")
    with monkeypatch.context() as interrupted:
        interrupted.setattr(Evaluator, "evaluate", lambda *_, **__: None)
        resume(run)
    assert runs.record(run)["task"] == before, "the next resumption evaluates it"
    resume(run)
    after = checkpoint(run)["history"]["best"]
    assert "best.pt is evaluated again" in capsys.readouterr().out
    assert after == [step_of_best, score / 2] and runs.record(run)["task"] == "another"
    resume(run)
    assert checkpoint(run)["history"]["best"] == after


def test_python_s_and_gymnasium_s_files_are_no_part_of_a_task() -> None:
    own = Path(sys.modules[OnlyOne.__module__].__file__).read_bytes()
    assert source_digest(OnlyOne()) == hashlib.sha256(own).hexdigest()


def test_an_evaluation_that_a_checkpoint_knows_of_is_not_held_again(tmp_path: Path) -> None:
    options = {"checkpoint_frequency": 50, "keep_checkpoints": 0, "total_timesteps": 200}
    whole, run = (train(tmp_path / name, "dqn", **options) for name in ("whole", "run"))
    for path in (run / "last.pt", run / "checkpoints/step_000000200.pt"):
        path.unlink()  # killed after the one of step 150, which was evaluated
    assert checkpoint(run, "checkpoints/step_000000150.pt")["history"]["evaluations"]
    assert_same_run(whole, resume(run))
    runs.assert_no_doubles(run)


@pytest.mark.parametrize("name", EXACT)
def test_it_can_be_resumed_from_the_first_moment_on(whole, tmp_path, monkeypatch, name) -> None:
    def killed(*arguments: object) -> None:
        raise Killed

    with monkeypatch.context() as patched:
        patched.setattr(CheckedEnvironment, "step", killed)
        with pytest.raises(Killed):
            train(tmp_path / "run", name)
    assert checkpoint(tmp_path / "run")["steps"] == 0
    assert_same_run(whole(name), resume(tmp_path / "run"))


@pytest.mark.parametrize("name", EXACT)
def test_killed_between_the_names_of_a_best_checkpoint(whole, tmp_path, monkeypatch, name) -> None:
    """Resumed, the training comes to the same best checkpoint."""
    give_name, save, bests = run_checkpoints.give_name, Checkpoints.save, [False]

    def saved(writer: Checkpoints, step: int, content: dict, best: bool = False) -> None:
        bests.append(best)
        save(writer, step, content, best)

    def killed(path: Path, to: Path) -> None:
        give_name(path, to)
        if bests[-1]:
            raise Killed

    with monkeypatch.context() as patched:
        patched.setattr(Checkpoints, "save", saved)
        patched.setattr(run_checkpoints, "give_name", killed)
        with pytest.raises(Killed):
            train(tmp_path / "run", name)
    assert_same_run(whole(name), resume(tmp_path / "run"))


@pytest.mark.parametrize("name", EXACT)
def test_killed_before_its_first_checkpoint_it_begins_anew(whole, tmp_path, capsys, name) -> None:
    run = train(tmp_path / "run", name, runs.InterruptAfter(2))
    (run / "last.pt").unlink()
    for path in (run / "checkpoints").iterdir():
        path.rename(path.with_name(f".{path.name}.a1b2c3"))  # half written
    resume(run)
    assert "has no checkpoint yet; starting from scratch" in capsys.readouterr().out
    assert_same_run(whole(name), run)
    runs.assert_no_doubles(run)
    assert not list((run / "checkpoints").glob(".*"))


def test_half_written_files_of_a_killed_training_are_removed(stopped: Path) -> None:
    left = [stopped / "checkpoints" / ".step_000000070.pt.a1b2c3", stopped / ".config.json.d4e5f6",
            stopped / ".last.pt.new", stopped / ".policy_network.pth.abc"]  # fmt: skip
    for path in left:
        path.write_bytes(b"half")
    mine = stopped / ".notes"
    mine.write_text("mine")
    resume(stopped)
    assert not any(path.exists() for path in left) and mine.exists()
