"""Run folders: new each time, one training in each; their records, and what a resumed one may change."""

import json
from pathlib import Path

import pytest
import torch
from support.training.training_runs import ALL, EXACT, failure, flags, small, train

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.runs import open_run
from rl_workbench.training.algorithms import ALGORITHMS, algorithm
from rl_workbench.training.folder import held, opened
from rl_workbench.training.options import EXTENDING, recorded_options
from rl_workbench.training.train import choose

PLACE = ("cartpole/Classic-v0", "a/b:c", 7)


def begin(*place: object) -> Path:
    """A folder in which a training has begun."""
    with opened(*place) as folder:
        (folder / "config.json").write_text("")
    return folder


def test_the_default_folder_is_new_each_time(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.time", lambda: 5.0)
    name = "cartpole-Classic-v0__a-b-c__7__5"
    made = [begin("", *PLACE) for _ in range(3)]
    assert made == [tmp_path / "runs" / each for each in (name, f"{name}_2", f"{name}_3")]


def test_a_folder_may_be_named_and_may_be_there_if_it_is_empty(tmp_path: Path) -> None:
    assert begin(str(tmp_path / "some/where"), *PLACE) == tmp_path / "some/where"
    (tmp_path / "empty").mkdir()
    with opened(str(tmp_path / "empty"), *PLACE) as folder:
        assert folder == tmp_path / "empty" and not list(folder.iterdir())
        (folder / "mine").write_text("")


def test_one_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    inside = opened(str(tmp_path / "file" / "run"), *PLACE)
    with pytest.raises(WorkbenchError, match=r"can't write to .*Not a directory"), inside:
        pass


def test_one_that_is_in_use(tmp_path: Path) -> None:
    second = held(tmp_path)
    with held(tmp_path), pytest.raises(WorkbenchError, match="is running in"), second:
        pass
    with held(tmp_path):  # the first one is over
        pass
    with pytest.raises(WorkbenchError, match="is not a run folder"), held(tmp_path / "none"):
        pass


@pytest.mark.parametrize("name", ALL)
def test_a_record_comes_back(name: str) -> None:
    """Also by way of JSON, which knows no tuples."""
    options = small(name, env_kwargs={"a": 1, "b": [1, {"c": None}]}, stop_at_return=5)
    content = options.record()
    assert recorded_options(content, "here") == options
    assert recorded_options(json.loads(json.dumps(content)), "here") == options


def test_a_checkpoints_record_of_tensors_is_one_line() -> None:
    content = small("dqn").record()
    content["run"]["seed"] = torch.zeros(0)
    with pytest.raises(WorkbenchError, match=r"^here isn't the record of a training: .*Tensor"):
        recorded_options(content, "here")


@pytest.mark.parametrize("value", [None, {}, [], 3])
def test_an_algorithm_without_a_name_is_one_line(tmp_path: Path, value: object) -> None:
    content = small("dqn").record() | {"algorithm": value}
    (tmp_path / "config.json").write_text(json.dumps(content))
    with pytest.raises(WorkbenchError, match="its record is damaged: algorithm is "):
        open_run(tmp_path)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return train(tmp_path_factory.mktemp("done"), "reinforce", episodes=3)


def test_what_may_be_extended(done: Path) -> None:
    given = {"total_timesteps": 900, "episodes": 5, "stop_at_length": 450.0,
             "stop_at_return": 475.0, "device": "cpu"}  # fmt: skip
    assert set(given) == set(EXTENDING)
    options = choose(ALGORITHMS["reinforce"], [f"--resume={done}", *flags(given)])
    assert options.resume == done
    assert {name: getattr(options.run, name) for name in given} == given
    before = small("reinforce", episodes=3)
    assert options.hyperparameters == before.hyperparameters
    assert options.run.eval_frequency == before.run.eval_frequency
    parameters = {"resume": str(done), "episodes": 5}
    assert choose(ALGORITHMS["reinforce"], [], parameters).run.episodes == 5


@pytest.mark.parametrize(
    ("flag", "given"),
    [("--seed", ["--seed=1"]), ("--gamma", ["--gamma=0.5"]), ("--config", ["--config=x"]),
     ("--seed", ["--params", "seed=1"]), ("--env-id", ["--env-id=A-v0"]),
     ("--eval-frequency", ["--eval-frequency=3"]), ("--run-dir", ["--run-dir=x"])],
)  # fmt: skip
@pytest.mark.parametrize("name", EXACT)
def test_what_may_not(done: Path, name: str, flag: str, given: list[str]) -> None:
    line = failure(lambda: choose(algorithm(name), [f"--resume={done}", *given]))
    others = "--total-timesteps, --episodes, --stop-at-length, --stop-at-return, --device"
    assert f"--resume allows no {flag}, only {others}" in line
