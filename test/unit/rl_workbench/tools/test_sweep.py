"""The search for options: ranges, trials that fail or fall behind, a search that is ended and goes on."""

import errno
import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml
from support.training.workbench_runs import work

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.tools import sweep as search_module
from rl_workbench.tools.job import Ending, Job, StopWithin
from rl_workbench.tools.jobs import JobPool
from rl_workbench.tools.sweep import OptionRange, Sweep, read_ranges
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options import known_options

pytestmark = pytest.mark.extras("optuna", "stable_baselines3")
RANGES = {"x": OptionRange(-10.0, 10.0, False, ()), "kind": OptionRange(0, 0, False, ("a", "b"))}
EVERY, STEPS = 100, 400
Curve = Callable[[int, float], float]  # of a seed and x: the return that it comes to


@pytest.fixture(autouse=True)
def no_waiting_for_disks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each line of a journal is put on the disk, which takes long on a busy machine; no power is cut here."""
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)


def parabola(seed: int, x: float) -> float:
    return seed - (x - 3.0) ** 2


class QuickSweep(Sweep):
    """One whose options are none of a real algorithm."""

    def run_options(self, values: dict[str, Any]) -> Any:
        return SimpleNamespace(eval_frequency=EVERY, total_timesteps=STEPS)


class Trainer:
    """Trainings that come to what a function says, which raises a ValueError if one fails."""

    def __init__(self, curve: Curve) -> None:
        self._curve = curve
        self.stopped: set[str] = set()
        self.begun: list[str] = []

    def __call__(self, job: Job, stop_within: StopWithin, say: Callable[[str], None]) -> Ending:
        self.begun.append(job.name)
        job.folder.mkdir(parents=True, exist_ok=True)
        given = dict(each.split("=") for each in job.flags if each.count("=") == 1)
        rows = ["step,tag,value,wall_time"]
        for step in range(EVERY, STEPS + 1, EVERY):
            try:
                final = self._curve(int(given["--seed"]), float(given["x"]))
            except ValueError as error:
                job.log.write_text(f"{error}\n")
                return Ending(1)
            rows.append(f"{step},eval/mean_reward,{final + step - STEPS},0")
            (job.folder / "scalars.csv").write_text("\n".join(rows) + "\n")
            if step < STEPS and stop_within() is not None:
                self.stopped.add(job.name)
                return Ending(143)
        summary = {"complete": True, "best": [STEPS, final], "steps": STEPS, "seconds": 1.0}
        (job.folder / "summary.json").write_text(json.dumps(summary))
        return Ending(0)


def search(
    folder: Path, trials: int, curve: Curve = parabola, seeds: int = 1, at_once: int = 1,
    pruner: str = "none", interrupt: Interrupt | None = None,
) -> Trainer:  # fmt: skip
    folder.mkdir(exist_ok=True)
    sweep = QuickSweep(folder, "dqn", {}, RANGES, trials, seeds, 0, pruner, "Some-v0")
    trainer, interrupt = Trainer(curve), interrupt or Interrupt()
    study = search_module.open_study(sweep)
    search_module.Search(
        sweep, study, JobPool(folder, trainer, at_once, interrupt), interrupt
    ).run()
    search_module.write_results(sweep, study)
    return trainer


def trials(folder: Path) -> list[dict[str, Any]]:
    return json.loads((folder / "trials.json").read_text())


def states(folder: Path) -> list[str]:
    return [row["state"] for row in trials(folder)]


def test_it_finds_the_best_and_writes_it_down(tmp_path: Path) -> None:
    search(tmp_path, 25)
    best = yaml.safe_load((tmp_path / "best.yaml").read_text())["Some-v0"]
    assert best["x"] == pytest.approx(3.0, abs=1.5)
    assert len(trials(tmp_path)) == 25


def test_a_study_is_gone_on_with_as_if_it_had_been_one(tmp_path: Path) -> None:
    search(tmp_path / "parts", 3)
    search(tmp_path / "parts", 15)
    assert search(tmp_path / "parts", 15).begun == []
    search(tmp_path / "one", 15)
    assert trials(tmp_path / "parts") == trials(tmp_path / "one")
    assert len({row["options"]["x"] for row in trials(tmp_path / "one")}) == 15


def test_the_score_is_the_mean_over_seeds(tmp_path: Path) -> None:
    search(tmp_path, 1, seeds=3)
    (row,) = trials(tmp_path)
    assert row["score"] == pytest.approx(1.0 - (row["options"]["x"] - 3.0) ** 2)


def failing_above(limit: float) -> Curve:
    def curve(seed: int, x: float) -> float:
        if x > limit:
            raise ValueError("the loss is nan")
        return x

    return curve


def test_a_trial_that_fails_costs_no_other(tmp_path: Path) -> None:
    trainers = search(tmp_path, 8, failing_above(0.0), seeds=2)
    for row in trials(tmp_path):
        assert row["state"] == ("fail" if row["options"]["x"] > 0.0 else "complete")
        assert ("the loss is nan" in (row["failure"] or "")) == (row["state"] == "fail")
    assert len(set(states(tmp_path))) == 2
    # The second seed of one whose first has failed isn't trained.
    assert len(trainers.begun) == 8 + states(tmp_path).count("complete")


@pytest.mark.parametrize("pruner", ["median", "hyperband"])
def test_trials_that_fall_behind_are_ended(tmp_path: Path, pruner: str) -> None:
    trainers = search(tmp_path, 20, pruner=pruner, seeds=2)
    pruned = [row for row in trials(tmp_path) if row["state"] == "pruned"]
    assert len(pruned) >= 3
    assert trainers.stopped == {
        f"trial_{row['number']:04d}, seed 0" for row in pruned if row["pruned_at"] < STEPS
    }
    assert len(trainers.begun) == 40 - len(pruned)  # nor is a second seed of theirs trained
    best = yaml.safe_load((tmp_path / "best.yaml").read_text())["Some-v0"]
    scores = [(row["score"], row["options"]) for row in trials(tmp_path) if row not in pruned]
    assert max(scores, key=lambda row: row[0])[1] == best


def test_a_kill_between_any_two_lines_of_the_journal_changes_nothing(tmp_path: Path) -> None:
    """Optuna's first ten trials are random, later ones learn from what was found."""
    search(tmp_path / "one", 12, pruner="median")
    lines = (tmp_path / "one/study.journal").read_bytes().splitlines(keepends=True)
    for count in range(0, len(lines), 3):
        folder = tmp_path / str(count)
        folder.mkdir()
        (folder / "study.journal").write_bytes(b"".join(lines[:count]))
        search(folder, 12, pruner="median")
        assert trials(folder) == trials(tmp_path / "one")
        assert (folder / "best.yaml").read_bytes() == (tmp_path / "one/best.yaml").read_bytes()


def test_nobody_waits_for_one_who_was_killed_while_he_wrote(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "study.journal.lock").symlink_to("study.journal")
    monkeypatch.setattr("optuna.storages.journal._file.time.sleep", lambda seconds: pytest.fail())
    search(tmp_path, 1)


def test_with_several_at_once_the_first_ten_trials_are_the_same(tmp_path: Path) -> None:
    search(tmp_path / "one", 10)
    search(tmp_path / "three", 10, at_once=3)
    assert trials(tmp_path / "three") == trials(tmp_path / "one")


def test_a_trial_that_is_interrupted_goes_on(tmp_path: Path) -> None:
    interrupt = Interrupt()

    def curve(seed: int, x: float) -> float:
        if len(list(tmp_path.glob("trial_*"))) == 2:
            interrupt.signal = signal.SIGINT
        return x

    trainers = search(tmp_path, 4, curve, interrupt=interrupt)
    assert states(tmp_path) == ["complete", "running"]
    assert trainers.stopped == {"trial_0001, seed 0"}
    x = trials(tmp_path)[1]["options"]["x"]
    assert search(tmp_path, 4).begun[0] == "trial_0001, seed 0"
    assert states(tmp_path) == ["complete"] * 4
    assert trials(tmp_path)[1]["options"]["x"] == x


@pytest.mark.parametrize(
    "damage", [b"no journal" * 100, b"no\njournal\n", b'{"op_code": 99}\n' * 2]
)
def test_a_damaged_study(tmp_path: Path, damage: bytes) -> None:
    (tmp_path / "study.journal").write_bytes(damage)
    with pytest.raises(WorkbenchError, match="isn't a study"):
        search(tmp_path, 1)


def test_a_line_that_a_kill_has_cut_off(tmp_path: Path) -> None:
    search(tmp_path, 3)
    before = trials(tmp_path)
    with (tmp_path / "study.journal").open("ab") as file:
        file.write(b'{"op_code": 4, "wor')
    search(tmp_path, 4)
    search(tmp_path, 5)
    assert trials(tmp_path)[:3] == before
    assert len(trials(tmp_path)) == 5


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
        names = known_options(ALGORITHMS["dqn"]).names
        read_ranges(tmp_path / "a.yaml", "dqn", "CartPole-v1", names)


@pytest.mark.parametrize("algorithm", ["dqn", "ppo", "sac"])
def test_the_packages_own_ranges(algorithm: str) -> None:
    assert read_ranges(None, algorithm, "Any-v0", known_options(ALGORITHMS[algorithm]).names)


@pytest.fixture
def command(tmp_path: Path) -> Callable[..., list[object]]:
    ranges = tmp_path / "ranges.yaml"
    ranges.write_text(
        "dqn: {gamma: {choices: [0.98, 0.99]}, eval_frequency: {choices: [200]}, "
        "confirm_episodes: {choices: [2]}}\n"
        "ppo: {gamma: {choices: [0.98]}, n_steps: {choices: [64]}, eval_frequency: {choices: [64]}}\n"
        "reinforce: {gamma: {choices: [0.98]}, batch_episodes: {choices: [1, 2]}}"
    )

    def words(algorithm: str) -> list[object]:
        return ["sweep", "--algo", algorithm, "--out", tmp_path / "study", "--trials=1",
                "--ranges", ranges, "--total-timesteps=200"]  # fmt: skip

    return words


@pytest.mark.parametrize("algorithm", ["dqn", "reinforce", "ppo"])
def test_the_command_trains_and_writes_best_options(tmp_path, algorithm, command, capsys) -> None:
    assert work(*command(algorithm)) == 0
    assert states(tmp_path / "study") == ["complete"]
    assert "its options are in" in capsys.readouterr().out
    best = yaml.safe_load((tmp_path / "study" / "best.yaml").read_text())
    assert list(best) == ["ppo CartPole-v1" if algorithm == "ppo" else "CartPole-v1"]


def test_a_folder_of_another_search_is_refused(tmp_path: Path, command, refused) -> None:
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "sweep.json").write_text("{}")
    assert "other options, ranges or seeds" in refused(*command("dqn"))


def test_a_disk_that_is_full_is_one_line(tmp_path: Path, command, monkeypatch, refused) -> None:
    from optuna.storages.journal import JournalFileBackend

    def refuse(self: Any, logs: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(JournalFileBackend, "append_logs", refuse)
    line = refused(*command("dqn"))
    assert f"can't write to {tmp_path}/study: No space left on device" in line
