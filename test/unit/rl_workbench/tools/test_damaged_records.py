"""Records and summaries of other types, and readers that go away: what the commands make of them."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.training.training_runs import train

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


@pytest.mark.slow
def test_a_reader_that_goes_away_costs_no_file(made: Path, tmp_path: Path) -> None:
    out, (reading, writing) = tmp_path / "x.json", os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "rl_workbench", "eval", made, "--episodes=2", "--json", out]
    subprocess.run(command, stdout=writing, check=True)
    os.close(writing)
    assert json.loads(out.read_text())["episodes"] == 2
