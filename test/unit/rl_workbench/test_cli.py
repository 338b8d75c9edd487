"""The command line as a whole: who is asked, by which name, and what it imports for that."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rl_workbench.cli import COMMANDS, main
from rl_workbench.training.train import PROGRAM

SRC = Path(__file__).parents[3] / "src"
OURS = {path.name for path in SRC.iterdir() if path.is_dir()}
HEAVY = ("gymnasium", "numpy", "torch", "ray", "optuna", "viser", "trimesh", "matplotlib",
         "stable_baselines3", "pybullet", "torch._dynamo")  # fmt: skip
COUNT = f"""
import sys
from rl_workbench.cli import main
try:
    main(sys.argv[1:])
except SystemExit:
    pass
print(*sorted(name for name in sys.modules if name.partition(".")[0] in {OURS!r}), sep="\\n")
print(*(name for name in {HEAVY!r} if name in sys.modules))
"""


def test_ctrl_c_while_it_is_still_being_read(tmp_path: Path) -> None:
    swallowed = "try:\n    signal.raise_signal(signal.SIGINT)\nexcept BaseException:\n    pass\n"
    (tmp_path / "torch.py").write_text(f"import signal\n{swallowed}")
    paths = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [*PROGRAM, "train", "--algo=dqn"], env={**os.environ, "PYTHONPATH": paths}, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    line = "rl-workbench train: interrupted\n"
    assert (done.returncode, done.stdout, done.stderr) == (130, "", line)


@pytest.mark.parametrize("prog", ["rl-workbench", "workbench.py"])
def test_errors_begin_with_the_commands_name(tmp_path: Path, prog: str, capsys) -> None:
    assert main(["eval", str(tmp_path)], prog) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{prog}: {tmp_path} is not a run folder")
    with pytest.raises(SystemExit) as ended:
        main(["train", f"--resume={tmp_path}"], prog)
    usage, line = capsys.readouterr().err.splitlines()
    assert ended.value.code == 2 and usage.startswith(f"usage: {prog} train")
    assert line.startswith(f"{prog} train: error: {tmp_path} is not a run folder")


def test_it_can_be_started_without_a_script() -> None:
    for command in (["nonsense"], ["train", "--algo=dqm"]):
        ended = subprocess.run([*PROGRAM, *command], capture_output=True, text=True, check=False)
        assert ended.returncode == 2 and "Traceback" not in ended.stderr
        assert f"{' '.join(['rl-workbench', *command[:-1]])}: error: unknown " in ended.stderr


def test_help_names_all_commands(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    told = capsys.readouterr().out
    assert ended.value.code == 0 and set(COMMANDS) == set(re.findall(r"^ {4}(\w+)", told, re.M))


def imported(*arguments: str) -> tuple[list[str], list[str]]:
    """Our modules, and heavy libraries, that a command imports."""
    command = [sys.executable, "-c", COUNT, *arguments]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    *lines, heavy = output.split("\n")[:-1]
    return [line for line in lines if line.partition(".")[0] in OURS], heavy.split()


@pytest.mark.slow
def test_a_training_imports_few_of_our_files(tmp_path: Path) -> None:
    short = ["--total-timesteps=50", "--eval-episodes=1", "--confirm-episodes=0"]
    flags = ["--algo=dqn", "--env-id=CartPole-v1", *short, f"--run-dir={tmp_path / 'run'}"]
    ours, heavy = imported("train", *flags)
    assert "torch._dynamo" not in heavy, "torch's compiler"
    assert (tmp_path / "run/summary.json").is_file()
    assert len(ours) <= 60, ours


@pytest.mark.parametrize("words", ["", "train", "train --algo=dqn", "train --algo=sac"])
def test_help_imports_nothing_heavy(words: str) -> None:
    _, heavy = imported(*words.split(), "--help")
    assert not heavy
