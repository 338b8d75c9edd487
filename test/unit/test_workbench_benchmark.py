"""`workbench.py benchmark`: suites, trainings as processes, tables that leave no failure out."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from unit import workbench_runs

from cartpole.errors import CartpoleError
from cartpole.training.interrupt import Interrupt
from cartpole.workbench import cli
from cartpole.workbench.benchmark import Row, examine, summary_table
from cartpole.workbench.suites import CONFIG, arguments, default_file, make_variant, read_suite
from cartpole.workbench.trainings import Job, Trainings

QUICK = {"total_timesteps": 300, "learning_starts": 50, "batch_size": 8, "hidden_sizes": [8],
         "eval_frequency": 150, "eval_episodes": 1, "confirm_episodes": 1}  # fmt: skip
SUITE = """
two:
  about: Two ways.
  seeds: 1
  common: {total_timesteps: 300, learning_starts: 50, batch_size: 8, hidden_sizes: [8, 4],
           eval_frequency: 150, eval_episodes: 1, confirm_episodes: 1}
  variants:
    plain: {double: false, env_kwargs: {sutton_barto_reward: true}}
    broken: {env_id: NoSuch-v0}
"""


@pytest.fixture(autouse=True)
def signals() -> Iterator[None]:
    """The commands take over signals, as in a process of their own."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def suites(tmp_path: Path) -> Path:
    path = tmp_path / "suites.yaml"
    path.write_text(SUITE)
    return path


def job(folder: Path, seed: int = 0, **options: object) -> Job:
    return Job(make_variant("test", "quick", {**QUICK, **options}), seed, folder / f"seed_{seed}")


def test_every_suite_of_the_package_has_options_that_exist() -> None:
    import yaml

    for name in yaml.safe_load(default_file(CONFIG).read_text()):
        suite = read_suite(name)
        assert suite.variants and suite.about


def test_a_suite_gives_tables_with_every_seed_and_every_failure(
    suites: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    command = ["benchmark", "two", f"--suites={suites}", f"--out={out}", "--episodes=2", "--jobs=2"]
    assert cli.main(command) == 0
    said = capsys.readouterr().out
    assert "broken, seed 0: ended with exit code 1" in said
    rows = {row["variant"]: row for row in json.loads((out / "results.json").read_text())["runs"]}
    assert rows["plain"]["steps"] == 300 and rows["plain"]["best"] is not None
    assert rows["plain"]["cpu_seconds"] > 0
    config = json.loads((out / "plain/seed_0/config.json").read_text())
    assert config["dqn"]["hidden_sizes"] == [8, 4] and not config["dqn"]["double"]
    assert config["run"]["env_kwargs"] == {"sutton_barto_reward": True}
    assert config["run"]["exp_name"] == "plain"
    assert rows["broken"]["best"] is None and "no run folder" in rows["broken"]["fault"]
    text = (out / "results.md").read_text()
    assert "| plain | 0 of 1 |" in text and "| broken | 0 of 1 |" in text
    for name in ("curves.png", "evaluations.png"):
        assert (out / name).read_bytes().startswith(b"\x89PNG")
    before = (out / "plain/seed_0/summary.json").stat().st_mtime_ns
    assert cli.main(command) == 0  # what is done isn't done again
    assert (out / "plain/seed_0/summary.json").stat().st_mtime_ns == before


def test_an_interrupted_benchmark_goes_on_where_it_was(tmp_path: Path) -> None:
    out = tmp_path / "out"
    params = [f"{key}={value}" for key, value in QUICK.items() if key != "hidden_sizes"]
    params += ["hidden_sizes=8", "total_timesteps=20000000"]
    command = [sys.executable, "-m", "cartpole.workbench", "benchmark", f"--out={out}",
               "--seeds=1", "--params", *params]  # fmt: skip
    run = out / "dqn__CartPole-v1/seed_0"
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=dict(os.environ))
    try:
        while not (run / "last.pt").exists():
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)  # to the benchmark alone: it has to end its training
        said, _ = process.communicate()
    finally:
        process.kill()
    assert process.returncode == 143 and "interrupted; the same command goes on" in said
    first = json.loads((run / "summary.json").read_text())
    assert first["interrupted"] and not first["complete"]
    shorter = json.loads((run / "config.json").read_text())
    shorter["dqn"]["total_timesteps"] = first["steps"] + 50
    (run / "config.json").write_text(json.dumps(shorter))
    Trainings(lambda text: None).run([Job(make_variant("t", "t", {}), 0, run)], 1, Interrupt())
    assert json.loads((run / "summary.json").read_text())["steps"] == first["steps"] + 50


def test_a_folder_of_other_options_is_refused(
    suites: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "suite.json").write_text("[]")
    assert cli.main(["benchmark", "two", f"--suites={suites}", f"--out={out}"]) == 1
    assert "runs with other options" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["ablatoin_tuned"], "did you mean ablation_tuned"),
        (["--params", "gama=0.9"], "did you mean gamma"),
        (["cartpole", "--env-id", "CartPole-v1"], "a suite says itself"),
        (["--params", "seed=3"], "seed is given by the benchmark"),
    ],
)
def test_wrong_input_is_a_line(
    arguments: list[str], line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["benchmark", *arguments, f"--out={tmp_path / 'out'}"]) == 1
    assert line in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "content", ["s: {variants: {}}", "s: {variant: {a: {}}}", "s: {variants: {a: {algo: dqm}}}"]
)
def test_a_suite_that_makes_no_sense_is_refused(content: str, tmp_path: Path) -> None:
    path = tmp_path / "suites.yaml"
    path.write_text(content)
    with pytest.raises(CartpoleError, match="a suite has variants|algo is one of"):
        read_suite("s", path)


def test_a_failed_training_stays_in_the_table(tmp_path: Path) -> None:
    one = job(tmp_path)
    workbench_runs.record(one.folder, [20.0] * 30)
    (one.folder / "summary.json").write_text(
        json.dumps({"complete": False, "failure": "the loss is nan", "returns": [20.0] * 30})
    )
    row = examine(one, 2, lambda text: None)
    assert row.best is None and row.fault.startswith("the loss is nan")
    assert row.avg20 == pytest.approx(20.0)


def test_seeds_that_never_solve_count_as_never() -> None:
    def row(seed: int, best: float, step: int | None) -> Row:
        return Row("a", seed, best, best, best, best, step, None, 100, 5, 1.0, 1.0, "")

    rows = [row(0, 480.0, 100), row(1, 500.0, 300), row(2, 20.0, None)]
    line = summary_table(rows, 475.0).splitlines()[2]
    assert "| a | 2 of 3 |" in line and "| 300 | never |" in line


def test_the_training_is_told_all_of_its_options(tmp_path: Path) -> None:
    variant = make_variant("t", "wide", {"preset": "tutorial", "hidden_sizes": [64, 32]})
    told = arguments(variant, 1, tmp_path)
    assert told[:2] == ["--algo", "dqn"]
    assert {"--preset=tutorial", "--seed=1", "--exp-name=wide"} <= set(told)
    assert told[told.index("--params") + 1 :] == ["hidden_sizes=64,32"]
