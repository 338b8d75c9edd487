"""`rl-workbench benchmark`: suites, trainings as processes, tables that leave no failure out."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import asdict
from pathlib import Path

import pytest
from support.training import workbench_runs
from support.training.workbench_runs import QUICK, job

from rl_workbench import cli
from rl_workbench.errors import WorkbenchError
from rl_workbench.tools import jobs as jobs_module
from rl_workbench.tools import results
from rl_workbench.tools.benchmark import (
    CONFIG,
    _suite,
    default_file,
    make_variant,
    read_suite,
    training_flags,
)
from rl_workbench.tools.jobs import Job, command
from rl_workbench.tools.results import SUMMARY, RunResult, examine, grouped, summary_table
from rl_workbench.tools.runs import open_run
from rl_workbench.training import folder as run_folder
from rl_workbench.training.train import PROGRAM

SB3 = pytest.mark.extras("stable_baselines3")
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


@pytest.fixture
def suites(tmp_path: Path) -> Path:
    path = tmp_path / "suites.yaml"
    path.write_text(SUITE)
    return path


def examined(one: Job) -> RunResult:
    return examine(open_run(one.folder), "quick", 2, lambda text: None, also_last=True)


@SB3
def test_every_suite_of_the_package_has_options_that_exist() -> None:
    import yaml

    for name in yaml.safe_load(default_file(CONFIG).read_text()):
        suite = read_suite(name)
        assert suite.variants and suite.about


@pytest.mark.slow
def test_a_suite_gives_tables_with_every_seed_and_every_failure(
    suites: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    command = ["benchmark", "two", f"--suites={suites}", f"--out={out}", "--episodes=2", "--jobs=2"]
    assert cli.main(command) == 1  # a training has failed
    said, err = capsys.readouterr()
    assert "1 of 2 trainings failed; the first one: " in err
    assert re.search(r"of 2, 1 failed\] broken, seed 0: ended with exit code 1, .*can't make NoSuch-v0", said)
    rows = {row["variant"]: row for row in json.loads((out / "results.json").read_text())["runs"]}
    assert rows["plain"]["steps"] == 300 and rows["plain"]["best"] is not None
    assert rows["plain"]["cpu_seconds"] > 0
    config = json.loads((out / "plain/seed_0/config.json").read_text())
    own = config["hyperparameters"]
    assert own["hidden_sizes"] == [8, 4] and not own["double"]
    assert config["run"]["env_kwargs"] == {"sutton_barto_reward": True}
    assert config["run"]["exp_name"] == "plain"
    assert rows["broken"]["best"] is None and "can't make NoSuch-v0" in rows["broken"]["fault"]
    text = (out / "results.md").read_text()
    assert "| plain | 0 of 1 |" in text and "| broken | 0 of 1, 1 failed |" in text
    assert "evaluating 1 of 2: 2 episodes each by the best and the last policy of plain" in said
    assert cli.main(["compare", str(out), "--episodes=0"]) == 0, "it takes the folder as it is"
    assert "plain in CartPole-v1" in capsys.readouterr().out
    for name in ("curves.png", "evaluations.png"):
        assert (out / name).read_bytes().startswith(b"\x89PNG")


def test_length_and_file_are_flags_as_of_train(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text("")
    words = ["--total-timesteps=5000", "--config=mine.yaml", "--params", "total_timesteps=1"]
    (variant,) = _suite(cli.parse(["benchmark", *words])).variants
    assert variant.options["total_timesteps"] == "5000"
    assert f"--config={tmp_path / 'mine.yaml'}" in training_flags(variant)


@pytest.mark.slow
def test_an_interrupted_benchmark_goes_on_where_it_was(tmp_path: Path) -> None:
    out = tmp_path / "out"
    params = [f"{key}={value}" for key, value in QUICK.items() if key != "hidden_sizes"]
    params += ["hidden_sizes=8", "total_timesteps=20000000"]
    words = [sys.executable, "-m", "rl_workbench", "benchmark", f"--out={out}",
             "--seeds=1", "--params", *params]  # fmt: skip
    run = out / "dqn__CartPole-v1/seed_0"
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=dict(os.environ))
    try:
        while not (run / "last.pt").exists():
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)  # to the benchmark alone: it has to end its training
        said, _ = process.communicate()
    finally:
        process.kill()
    assert process.returncode == 143 and "interrupted; run the same command again" in said
    first = json.loads((run / "summary.json").read_text())
    assert first["interrupted"] and not first["complete"]
    same = Job(out, run.parent.name, 0, ())
    assert not same.is_done() and command(same, PROGRAM)[-1] == f"--resume={run}"


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["ablatoin_tuned"], "did you mean ablation_tuned"),
        (["--params", "gama=0.9"], "did you mean gamma"),
        (["cartpole", "--env-id", "CartPole-v1"], "a suite defines its trainings"),
        (["cartpole", "--algo", "dqn"], "a suite defines its trainings"),
        (["cartpole", "--total-timesteps=1"], "a suite defines its trainings and takes no --algo"),
        (["--suites", "mine.yaml"], "which suite of mine.yaml"),
        (["--algo", "reinforce", "--params", "gama=0.9"], "did you mean gamma"),
        (["--params", "seed=3"], "the benchmark sets seed itself"),
        pytest.param(["--algo=ppo", "--params", "n_stepz=64"], "did you mean n_steps", marks=SB3),
    ],
)
def test_wrong_input_is_a_line(arguments: list[str], line: str, tmp_path: Path, capsys) -> None:
    assert cli.main(["benchmark", *arguments, f"--out={tmp_path / 'out'}"]) == 1
    assert line in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("variants: {}", "a suite has variants"),
        ("variant: {a: {}}", "a suite has variants"),
        ("variants: {a: {algo: dqm}}", "algo is one of"),
        ("variants: {a: 3}", "s: a has options"),
        ("variants: {a: {gamma: .nan}}", "s: a has options with plain values"),
        ("variants: {a: {env_kwargs: {since: 2020-01-01}}}", "s: a has options with plain values"),
        ("{variants: {a: {}}, common: [gamma]}", "common has options"),
        ("{variants: {a: {}}, seeds: many}", "seeds is a number from 1"),
        ("{variants: {a: {}}, seeds: 0}", "seeds is a number from 1"),
        ("variants: {../../a: {}}", "a variant's name is"),
        ("variants: {..: {}}", "a variant's name is"),
        ("variants: {a: {algo: reinforce, value_epoch: 3}}", "a: .*did you mean value_epochs"),
        ("variants: {a: {gamma: high}}", "a: .*gamma must be a number"),
    ],
)
def test_a_suite_that_makes_no_sense_is_refused(content: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "suites.yaml"
    path.write_text(f"s: {content if content[0] == '{' else '{' + content + '}'}")
    with pytest.raises(WorkbenchError, match=words):
        read_suite("s", path)


def test_a_failed_training_stays_in_the_table(tmp_path: Path) -> None:
    one = job(tmp_path)
    workbench_runs.record(one.folder, [20.0] * 30)
    (one.folder / "summary.json").write_text(
        json.dumps({"complete": False, "failure": "the loss is nan", "returns": [20.0] * 30})
    )
    row = examined(one)
    assert row.score is None and row.fault.startswith("the loss is nan")
    (one.folder / "summary.json").unlink()
    assert examined(one).fault.startswith("not complete")
    with run_folder.held(one.folder):
        assert examined(one).fault.startswith("running")
    assert row.avg20 == row.training_mean == pytest.approx(20.0)


def test_figures_that_cannot_be_read_are_faults(tmp_path: Path) -> None:
    one = job(tmp_path)
    workbench_runs.record(one.folder, [20.0] * 30)
    (one.folder / "scalars.csv").write_text("a,b\n1,2\n")
    row = examined(one)
    assert row.fault.count("isn't the table of a training") == 1 and "no policy" in row.fault


def test_the_step_to_solve_is_a_confirmed_one_if_there_is_any(tmp_path: Path) -> None:
    one = job(tmp_path)
    workbench_runs.record(one.folder, [20.0] * 30)
    rows = {300: "300,eval/mean_reward,475.0,0", 400: "400,eval/confirmed_reward,480.0,0"}
    for solved, row in rows.items():
        with (one.folder / "scalars.csv").open("a") as file:
            file.write(f"{row}\n")
        assert examined(one).solved_step == solved


def complete(out: Path) -> list[str]:
    """A benchmark whose only training is done; the command that goes on with it."""
    run = out / "dqn__CartPole-v1/seed_0"
    workbench_runs.record(run, [20.0] * 30, exp_name="dqn__CartPole-v1")
    (run / "summary.json").write_text(json.dumps({"complete": True, "steps": 300}))
    variant = make_variant("t", "dqn__CartPole-v1", {"env_id": "CartPole-v1"})
    (out / "suite.json").write_text(json.dumps([asdict(variant)]))
    return ["benchmark", f"--out={out}", "--seeds=1", "--episodes=1"]


def test_what_is_done_is_not_done_again(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(jobs_module, "command", lambda *_: pytest.fail("it is done"))
    assert cli.main(complete(tmp_path)) == 1  # it has no checkpoint to play
    assert (tmp_path / "results.md").exists()


def test_ctrl_c_while_policies_are_played(tmp_path: Path, monkeypatch) -> None:
    command = complete(tmp_path)
    monkeypatch.setattr(results, "examine", lambda *_, **__: signal.raise_signal(signal.SIGINT))
    assert cli.main(command) == 130
    assert not (tmp_path / "results.md").exists()


def test_a_folder_belongs_to_one_benchmark(tmp_path: Path, capsys) -> None:
    command = complete(tmp_path)
    with run_folder.held(tmp_path):
        assert cli.main(command) == 1
    assert f"another benchmark is running in {tmp_path}" in capsys.readouterr().err
    assert cli.main([*command, "--total-timesteps=7"]) == 1
    assert f"{tmp_path} holds a benchmark with other options" in capsys.readouterr().err
    (tmp_path / "suite.json").unlink()
    assert cli.main(command) == 1
    assert f"{tmp_path} holds something else" in capsys.readouterr().err


def test_a_damaged_record_costs_no_other_run_its_row(tmp_path: Path) -> None:
    command = complete(tmp_path)
    workbench_runs.record(tmp_path / "dqn__CartPole-v1/seed_1", [20.0] * 30)
    (tmp_path / "dqn__CartPole-v1/seed_1/summary.json").write_text('{"complete": true}')
    (tmp_path / "dqn__CartPole-v1/seed_1/config.json").write_text("{")
    assert cli.main([*command, "--seeds=2"]) == 1
    text = (tmp_path / "results.md").read_text()
    assert "isn't JSON" in text and "0 of 2, 2 failed" in text


# Tables.


def row(seed: int, score: float | None, step: int | None, fault: str = "") -> RunResult:
    return RunResult(
        "a", seed, "run", score, final=score, evaluations=score, solved_step=step, seconds=1.0,
        fault=fault,
    )  # fmt: skip


def summarised(rows: list[RunResult]) -> str:
    return summary_table(grouped(rows), SUMMARY).splitlines()[2]


def test_seeds_that_never_solve_count_as_never() -> None:
    rows = [row(0, 475.0, 100), row(1, 500.0, 300), row(2, 20.0, None)]
    line = summarised(rows)
    assert "| a | 2 of 3 |" in line and "| 300 | never |" in line


def test_a_statistic_tells_how_many_seeds_it_lacks() -> None:
    rows = [row(0, 480.0, 100), row(1, 500.0, 300), row(2, None, None, "the loss is nan")]
    cells = summarised(rows).split(" | ")
    assert cells[1] == "2 of 3, 1 failed" and cells[2] == "490.0 ± 14.1 (2 of 3)"
    assert all(cell.endswith(" (2 of 3)") for cell in cells[3:7])


def test_a_variant_without_any_run_has_a_line_of_its_own() -> None:
    line = summarised([RunResult("a", 0, "run", fault="no run folder")])
    assert line == "| a | 0 of 1, 1 failed | never | never |"
