"""The single-file examples run, stay within their bounds, and equal the library's algorithms bit for bit.

The same options, given to a file and to `workbench.py train`, have to lead to the same weights, bit for bit.
"""

import ast
import json
import runpy
import sys
from dataclasses import asdict, fields
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import torch
from torch.utils.tensorboard import SummaryWriter

from rl_workbench import cli

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "examples"
FILES = ["dqn_single_file.py", "reinforce_single_file.py"]
LONGEST = 250  # [lines]
LEAST = 500  # [steps] that a comparison needs


@pytest.fixture(autouse=True)
def kept_torch() -> Any:
    """Gives torch's generator and threads back: the files are made to have a process of their own."""
    threads, state = torch.get_num_threads(), torch.get_rng_state()
    yield
    torch.set_num_threads(threads)
    torch.set_rng_state(state)


def trained(example: ModuleType, flags: list[str], folder: Path) -> tuple[Any, ...]:
    """Two networks, the function that acts, and the returns, by the file."""
    with SummaryWriter(str(folder)) as writer:
        return example.train(example.parse_args(flags), writer)


def by_the_library(algorithm: str, flags: list[str], folder: Path) -> tuple[dict, dict]:
    """What `workbench.py train` leaves behind: the last checkpoint, and the summary."""
    words = ["train", "--algo", algorithm, "--run-dir", str(folder), "--eval-frequency", "0"]
    assert cli.main([*words, "--checkpoint-frequency", "0", *flags]) == 0
    checkpoint = torch.load(folder / "last.pt", weights_only=True)
    return checkpoint, json.loads((folder / "summary.json").read_text())


def every_flag(options: Any) -> list[str]:
    """All options of a file as the library's command line has them."""
    flags = []
    for name, value in asdict(options).items():
        flag = name.replace("_", "-")
        if isinstance(value, bool):
            flags.append(f"--{flag}" if value else f"--no-{flag}")
        else:
            text = ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
            flags.append(f"--{flag}={text}")
    return flags


def assert_same_weights(network: torch.nn.Module, state: dict[str, torch.Tensor]) -> None:
    """Layers have other names in the library, and the same order."""
    mine, theirs = list(network.state_dict().values()), list(state.values())
    assert [each.shape for each in mine] == [each.shape for each in theirs]
    assert all(torch.equal(one, other) for one, other in zip(mine, theirs, strict=True))


DQN = {
    "as it comes": ["--total-timesteps", "1100", "--seed", "3"],
    "plain": ["--total-timesteps", "600", "--n-step", "1", "--no-double", "--no-dueling",
              "--loss", "mse", "--reward-scale", "1", "--no-normalize-observations",
              "--learning-starts", "0", "--target-network-frequency", "10",
              "--exploration-fraction", "0"],
    "truncated, clipped, a buffer that overflows": [
        "--env-id", "Acrobot-v1", "--total-timesteps", "700", "--buffer-size", "300",
        "--max-grad-norm", "0.05", "--n-step", "5", "--batch-size", "16", "--hidden-sizes", "24",
        "--gamma", "0.9", "--end-e", "0.3", "--seed", "1", "--learning-starts", "200"],
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("flags", DQN.values(), ids=DQN.keys())
def test_dqn_comes_to_the_weights_of_the_library(flags: list[str], tmp_path, imported) -> None:
    example = imported("dqn_single_file")
    q_network, target_network, _, returns = trained(example, flags, tmp_path / "log")
    options = example.parse_args(flags)
    # As it comes: the file's defaults have to be those of config/dqn.yaml.
    given = flags if flags == DQN["as it comes"] else every_flag(options)
    checkpoint, summary = by_the_library("dqn", given, tmp_path / "run")
    assert summary["steps"] == options.total_timesteps >= LEAST
    assert returns == summary["returns"]
    assert_same_weights(q_network, checkpoint["q_net"])
    assert_same_weights(target_network, checkpoint["target_net"])


ROBOT = ["--env-id", "cartpole/Balance-v0"]
REINFORCE = {
    "as it comes": ["--episodes", "15", "--seed", "1"],
    "the robot, normalised": ["--episodes", "15", "--normalize-observations"],
    "batches, entropy, a hidden layer": [
        "--env-id", "CartPole-v1", "--episodes", "31", "--batch-episodes", "3",
        "--policy-hidden", "8", "--value-hidden", "16", "--entropy-coefficient", "0.02",
        "--normalize-observations", "--gae-lambda", "0.9", "--gamma", "0.98"],
    "three actions, truncated": [
        "--env-id", "Acrobot-v1", "--episodes", "3", "--batch-episodes", "2",
        "--value-epochs", "3"],
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("flags", REINFORCE.values(), ids=REINFORCE.keys())
def test_reinforce_comes_to_the_weights_of_the_library(flags, tmp_path: Path, imported) -> None:
    example = imported("reinforce_single_file")
    policy, value, _, returns = trained(example, flags, tmp_path / "log")
    # On the robot the file's defaults have to be those of config/pg.yaml.
    options = example.parse_args(flags)
    given = [*flags, *ROBOT] if options.env_id == example.ROBOT else every_flag(options)
    _, summary = by_the_library("reinforce", given, tmp_path / "run")
    assert summary["steps"] >= LEAST
    assert returns == summary["returns"]
    for network, name in ((policy, "policy_network"), (value, "value_network")):
        assert_same_weights(network, torch.load(tmp_path / f"run/{name}.pth", weights_only=True))


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [["dqn_single_file.py", "--total-timesteps", "600"],
     ["dqn_single_file.py", "--total-timesteps", "200", "--env-id", "cartpole:cartpole/Classic-v0"],
     ["reinforce_single_file.py", "--episodes", "20"]],
    ids=["dqn", "dqn on the robot", "reinforce"],
)  # fmt: skip
def test_it_runs_as_a_script(words: list[str], tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", words)
    runpy.run_path(str(EXAMPLES / words[0]), run_name="__main__")
    told = capsys.readouterr().out.splitlines()
    assert told[-1].startswith("20 greedy episodes: mean return ")
    assert len(list(tmp_path.glob("runs/*/events.out.tfevents.*"))) == 1


@pytest.mark.parametrize("name", FILES)
def test_help_explains_every_option(name: str, imported, capsys) -> None:
    example = imported(name.removesuffix(".py"))
    with pytest.raises(SystemExit) as ended:
        example.parse_args(["--help"])
    assert ended.value.code == 0
    text = " ".join(capsys.readouterr().out.split())
    for each in fields(example.Args):
        assert each.metadata["help"] in text


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_it_is_short_and_imports_nothing_of_ours(name: str) -> None:
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST
    ours = {path.name for path in (ROOT / "src").iterdir()}
    assert {"cartpole", "rl_workbench"} <= ours
    imported, used = set(), set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            imported.add(node.module)
        elif isinstance(node, ast.Name):
            used.add(node.id)
    assert not {"importlib", "runpy"} & imported
    # To import cartpole registers the environments, and that is all that a file may have of it.
    assert {each for each in imported if each.split(".")[0] in ours} <= {"cartpole"}
    assert not {"cartpole", "__import__"} & used
