"""The search for options: ranges, trials that fail or fall behind, a search that is ended and goes on."""

import json
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from rl_workbench import cli
from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.tools import sweep as sweep_module
from rl_workbench.tools.jobs import Job
from rl_workbench.tools.pool import Pool
from rl_workbench.tools.sweep import Sweep, open_study, read_ranges, write_best
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options import known_options

pytestmark = pytest.mark.extras("optuna", "stable_baselines3")
EVERY, STEPS = 100, 400
Curve = Callable[[int, float], float]  # of a seed and x: the return that it comes to


@pytest.fixture(autouse=True)
def no_waiting_for_disks() -> Iterator[None]:
    """A study is put on the disk at each step, which takes long on a busy machine; no power is cut here."""
    from sqlalchemy import event
    from sqlalchemy.engine import Engine

    def hurry(connection: Any, _: Any) -> None:
        connection.execute("PRAGMA synchronous=OFF")

    event.listen(Engine, "connect", hurry)
    yield
    event.remove(Engine, "connect", hurry)


def parabola(seed: int, x: float) -> float:
    return seed - (x - 3.0) ** 2


class Trainer:
    """Trainings that come to what a function says, which raises a ValueError if one fails."""

    def __init__(self, curve: Curve) -> None:
        self._curve = curve
        self.stopped: set[str] = set()
        self.begun: dict[str, float] = {}  # x of each

    def __call__(self, job: Job, is_stopped: Callable[[], bool]) -> str:
        job.folder.mkdir(parents=True, exist_ok=True)
        given = dict(each.split("=") for each in job.flags if each.count("=") == 1)
        x = self.begun[job.name] = float(given["x"])
        rows = ["step,tag,value,wall_time"]
        for step in range(EVERY, STEPS + 1, EVERY):
            try:
                final = self._curve(job.seed, x)
            except ValueError as error:
                return str(error)
            rows.append(f"{step},eval/mean_reward,{final + step - STEPS},0")
            (job.folder / "scalars.csv").write_text("\n".join(rows) + "\n")
            if step < STEPS and is_stopped():
                self.stopped.add(job.name)
                return ""
        summary = {"complete": True, "best": [STEPS, final], "steps": STEPS, "seconds": 1.0}
        (job.folder / "summary.json").write_text(json.dumps(summary))
        return ""


def search(
    folder: Path, trials: int, curve: Curve = parabola, seeds: int = 1, at_once: int = 1,
    pruner: str = "none", interrupt: Interrupt | None = None,
) -> Trainer:  # fmt: skip
    from optuna.distributions import CategoricalDistribution, FloatDistribution

    folder.mkdir(exist_ok=True)
    ranges = {"x": FloatDistribution(-10.0, 10.0), "kind": CategoricalDistribution(["a", "b"])}
    sweep = Sweep(folder, "dqn", {}, ranges, trials, seeds, 0, pruner)
    trainer, study = Trainer(curve), open_study(sweep)
    sweep_module.search(sweep, study, Pool(trainer, at_once, interrupt or Interrupt()))
    write_best(folder, study, "Some-v0")
    return trainer


def trials(folder: Path) -> list[dict[str, Any]]:
    import optuna

    study = optuna.load_study(study_name="sweep", storage=f"sqlite:///{folder}/study.db")
    return [
        {"folder": sweep_module._name(each), "state": each.state.name.lower(), "score": each.value,
         "options": each.params, "failure": each.user_attrs.get("failure"), "pruned_at": each.last_step}
        for each in sweep_module._ended(study)
    ]  # fmt: skip


def states(folder: Path) -> list[str]:
    return [row["state"] for row in trials(folder)]


def test_it_finds_the_best_and_writes_it_down(tmp_path: Path) -> None:
    search(tmp_path, 20, at_once=3)
    best = yaml.safe_load((tmp_path / "best.yaml").read_text())["Some-v0"]
    assert best["x"] == pytest.approx(3.0, abs=2.0)
    assert len(trials(tmp_path)) == 20


def test_a_study_goes_on_with_new_values(tmp_path: Path) -> None:
    search(tmp_path / "parts", 3)
    first = trials(tmp_path / "parts")
    search(tmp_path / "parts", 6)
    assert search(tmp_path / "parts", 6).begun == {}
    assert trials(tmp_path / "parts")[:3] == first
    assert len({row["options"]["x"] for row in trials(tmp_path / "parts")}) == 6
    search(tmp_path / "again", 3)
    assert trials(tmp_path / "again") == first


def test_the_score_is_the_mean_over_seeds(tmp_path: Path) -> None:
    search(tmp_path, 1, seeds=3)
    (row,) = trials(tmp_path)
    assert row["score"] == pytest.approx(1.0 - (row["options"]["x"] - 3.0) ** 2)


def test_a_trial_that_fails_costs_no_other(tmp_path: Path) -> None:
    def curve(seed: int, x: float) -> float:
        if x > 0.0:
            raise ValueError("the loss is nan")
        return x

    trainer = search(tmp_path, 8, curve, seeds=2)
    for row in trials(tmp_path):
        assert row["state"] == ("fail" if row["options"]["x"] > 0.0 else "complete")
        assert row["failure"] == ("the loss is nan" if row["state"] == "fail" else None)
    assert len(set(states(tmp_path))) == 2
    # The second seed of one whose first has failed isn't trained.
    assert len(trainer.begun) == 8 + states(tmp_path).count("complete")


@pytest.mark.parametrize("pruner", ["median", "hyperband"])
def test_trials_that_fall_behind_are_ended(tmp_path: Path, pruner: str) -> None:
    trainer = search(tmp_path, 15, pruner=pruner, seeds=2)
    pruned = [row for row in trials(tmp_path) if row["state"] == "pruned"]
    assert len(pruned) >= 3
    assert trainer.stopped == {
        f"{row['folder']}, seed 0" for row in pruned if row["pruned_at"] < STEPS / EVERY
    }
    assert len(trainer.begun) == 30 - len(pruned)  # nor is a second seed of theirs trained
    best = yaml.safe_load((tmp_path / "best.yaml").read_text())["Some-v0"]
    scores = [(row["score"], row["options"]) for row in trials(tmp_path) if row not in pruned]
    assert max(scores, key=lambda row: row[0])[1] == best


@pytest.mark.parametrize("at_once", [1, 3])
def test_a_trial_that_is_interrupted_goes_on(tmp_path: Path, at_once: int) -> None:
    interrupt = Interrupt()

    def curve(seed: int, x: float) -> float:
        if len(list(tmp_path.glob("trial_*"))) > at_once:
            interrupt.signal = signal.SIGINT
        return x

    first = search(tmp_path, 6, curve, at_once=at_once, interrupt=interrupt)
    assert first.stopped and "running" not in states(tmp_path)
    again = search(tmp_path, 6, at_once=at_once)
    assert {name: again.begun[name] for name in first.stopped}.items() <= first.begun.items()
    assert states(tmp_path) == ["complete"] * 6
    assert len({row["folder"] for row in trials(tmp_path)}) == 6


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("dqn: {learning_rat: {low: 0, high: 1}}", "did you mean learning_rate"),
        ("dqn: {gamma: 0.9}", "needs numbers low and high"),
        ("dqn: {gamma: {low: 1, high: 0}}", "`low <= high` must hold"),
        ("dqn: {gamma: {low: 0, high: 1, log: true}}", "must hold for `log=True`"),
        ("dqn: {gamma: {lowest: 0}}", "did you mean low"),
        ("dqn: {gamma: {choices: []}}", "must contain one or more"),
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
def command(tmp_path: Path) -> Iterator[Callable[..., int]]:
    ranges = tmp_path / "ranges.yaml"
    ranges.write_text(
        "dqn: {gamma: {choices: [0.98, 0.99]}, eval_frequency: {choices: [200]}, "
        "confirm_episodes: {choices: [2]}}\n"
        "ppo: {gamma: {choices: [0.98]}, n_steps: {choices: [64]}, eval_frequency: {choices: [64]}}\n"
        "reinforce: {gamma: {choices: [0.98]}, batch_episodes: {choices: [1, 2]}}"
    )

    def run(algorithm: str, *flags: str) -> int:
        return cli.main(
            ["sweep", "--algo", algorithm, "--out", str(tmp_path / "study"), "--trials", "2",
             "--ranges", str(ranges), "--total-timesteps", "200", *flags]
        )  # fmt: skip

    return run


@pytest.mark.parametrize("algorithm", ["dqn", "reinforce", "ppo"])
def test_the_command_trains_and_its_best_options_can_be_used(
    tmp_path: Path, algorithm: str, command: Callable[..., int], capsys
) -> None:
    assert command(algorithm, "--trials=1") == 0
    assert states(tmp_path / "study") == ["complete"]
    assert "its options are in" in capsys.readouterr().out
    best = yaml.safe_load((tmp_path / "study" / "best.yaml").read_text())
    assert list(best) == ["ppo CartPole-v1" if algorithm == "ppo" else "CartPole-v1"]
    (tmp_path / "study" / "study.db").write_bytes(b"no study" * 100)
    assert command(algorithm, "--trials=1") == 1
    assert "study.db can't be read or written: file is not a database" in capsys.readouterr().err


def test_a_folder_of_another_search_is_refused(tmp_path: Path, command, capsys) -> None:
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "sweep.json").write_text("{}")
    assert command("dqn") == 1
    assert "a search with other options" in capsys.readouterr().err
