"""Records and summaries of other types, and readers that go away: what the commands make of them."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.training.training_runs import ALL, InterruptAfter, train

from rl_workbench import cli

pytestmark = pytest.mark.usefixtures("signals")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return train(tmp_path_factory.mktemp("made") / "run", "dqn", total_timesteps=120)


@pytest.fixture
def own(made: Path, tmp_path: Path) -> Path:
    """A copy that a test may damage."""
    return Path(shutil.copytree(made, tmp_path / "own"))


@pytest.mark.parametrize("command", ["eval", "plot", "compare"])
@pytest.mark.parametrize(
    ("name", "value"),
    [("seed", "x"), ("seed", 1.5), ("env_id", []), ("env_kwargs", [1]), ("exp_name", None),
     ("eval_env_kwargs", 3)],
)  # fmt: skip
def test_a_record_of_other_types_is_one_line(
    own: Path, tmp_path: Path, capsys, command: str, name: str, value: object
) -> None:
    content = json.loads((own / "config.json").read_text())
    content["run"][name] = value
    (own / "config.json").write_text(json.dumps(content))
    flags = ["--out", str(tmp_path / "x.png")] if command == "plot" else []
    assert cli.main([command, str(own), *flags]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{own} is no run folder: its record is damaged" in line


@pytest.mark.parametrize("content", ["[1]", "5", '"x"', '{"returns": ["a"]}', '{"returns": 5}'])
def test_a_summary_of_other_types_is_a_fault_in_the_table(own: Path, capsys, content: str) -> None:
    (own / "summary.json").write_text(content)
    assert cli.main(["compare", str(own), "--episodes=1"]) == 0
    assert f"{own / 'summary.json'} isn't the summary of a training" in capsys.readouterr().out


def test_a_reader_that_goes_away_costs_no_file(made: Path, tmp_path: Path) -> None:
    out, (reading, writing) = tmp_path / "x.json", os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "rl_workbench", "eval", made, "--episodes=2", "--json", out]
    subprocess.run(command, stdout=writing, check=True)
    os.close(writing)
    assert json.loads(out.read_text())["episodes"] == 2


@pytest.fixture
def bound(monkeypatch) -> Iterator[None]:
    """Whoever waits for a pipe's other end fails."""

    def fail(number: int, frame: object) -> None:
        raise AssertionError("it waits for ever")

    before = signal.signal(signal.SIGALRM, fail)
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def code(arguments: list[str]) -> int | str | None:
    """The exit code."""
    try:
        return cli.main(arguments)
    except SystemExit as end:
        return end.code


def replace_by_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


@pytest.mark.usefixtures("bound")
@pytest.mark.parametrize(
    ("command", "name", "told"),
    [
        ("train --total-timesteps=240 --resume", "config.json", "config.json: it is not a file"),
        ("train --total-timesteps=240 --resume", "scalars.csv", "it is not a file"),
        ("eval --episodes=1", "config.json", "config.json: it is not a file"),
        ("plot --out=x.png", "scalars.csv", "scalars.csv: it is not a file"),
        ("compare --episodes=1", "config.json", "there is no run folder"),
    ],
)
def test_a_pipe_in_place_of_a_file_is_one_line(
    own: Path, tmp_path: Path, monkeypatch, capsys, command: str, name: str, told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    replace_by_pipe(own / name)
    assert code([*command.split(), str(own)])
    assert told in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.usefixtures("bound")
def test_a_pipe_for_a_summary_is_a_fault_in_the_table(own: Path, capsys) -> None:
    replace_by_pipe(own / "summary.json")
    assert cli.main(["compare", str(own), "--episodes=1"]) == 0
    assert "summary.json: it is not a file" in capsys.readouterr().out


@pytest.mark.usefixtures("bound")
@pytest.mark.parametrize("algorithm", ALL)
def test_a_checkpoint_that_is_a_pipe_or_device_is_passed_over(
    tmp_path: Path, capsys, algorithm: str
) -> None:
    run = train(tmp_path / "run", algorithm, InterruptAfter(1))
    replace_by_pipe(run / "last.pt")
    (run / "best.pt").unlink(missing_ok=True)
    (run / "best.pt").symlink_to("/dev/zero")
    for path in (run / "checkpoints").iterdir():
        replace_by_pipe(path)
    assert cli.main(["train", "--resume", str(run)]) == 1
    told = capsys.readouterr()
    assert f"can't read {run / 'last.pt'}: it is not a file" in told.out
    assert "holds no checkpoint to go on from" in told.err
    assert cli.main(["eval", str(run), "--episodes=1"]) == 1
    assert "it is not a file" in "".join(capsys.readouterr())
