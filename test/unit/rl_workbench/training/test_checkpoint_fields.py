"""Every field of every algorithm's checkpoint, made wrong: one line, or the training goes on; no traceback.

Torch writes beyond an optimizer's moments of another size: what isn't refused may crash the process.
"""

import copy
import random
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch
from support.training.training_runs import ALL, InterruptAfter, resume, train

from rl_workbench.errors import WorkbenchError
from rl_workbench.states import check_optimizer

WRONG: dict[str, Any] = {
    "None": None,
    "text": "text",
    "-1": -1,
    "1e30": 10**30,
    "list": [],
    "tensor": torch.zeros(3),
    "nan": float("nan"),
    "inf": torch.tensor(float("inf")),
}
SAMPLE = 12  # of each algorithm's fields, in a usual run


def fields(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The places of all values, of a list the first two; `format` and `config` have tests of their own."""
    if place and place[0] not in ("format", "config"):
        yield place
    if isinstance(value, dict):
        for key in value:
            yield from fields(value[key], (*place, key))
    elif isinstance(value, list | tuple):
        for index in range(min(len(value), 2)):
            yield from fields(value[index], (*place, index))


def put(content: Any, place: tuple[Any, ...], value: Any) -> None:
    first, *rest = place
    if rest:
        if isinstance(content[first], tuple):
            content[first] = list(content[first])
        put(content[first], tuple(rest), value)
    else:
        content[first] = value


@pytest.fixture(scope="module")
def halves(tmp_path_factory: pytest.TempPathFactory):
    """Gives a training that was interrupted in its midst, by algorithm."""
    made: dict[str, Path] = {}

    def half(name: str) -> Path:
        if name not in made:
            asked = {"dqn": 300, "ppo": 128, "sac": 150}.get(name, 250)
            made[name] = train(tmp_path_factory.mktemp(name), name, InterruptAfter(asked))
        return made[name]

    return half


def check(half: Path, folder: Path, good: dict, place: tuple[Any, ...], wrong: str) -> None:
    folder.mkdir()
    shutil.copy(half / "config.json", folder)
    content = copy.deepcopy(good)
    put(content, place, WRONG[wrong])
    torch.save(content, folder / "last.pt")
    try:
        resume(folder)
    except WorkbenchError as error:
        assert "\n" not in str(error), (place, wrong)
    except Exception as error:
        raise AssertionError(f"{'.'.join(map(str, place))} = {wrong}") from error


@pytest.mark.slow
@pytest.mark.parametrize("name", ALL)
def test_some_fields(halves, tmp_path: Path, name: str) -> None:
    half = halves(name)
    good = torch.load(half / "last.pt", weights_only=True)
    cases = [(place, wrong) for place in fields(good) for wrong in WRONG]
    for index, case in enumerate(random.Random(name).sample(cases, SAMPLE)):
        check(half, tmp_path / str(index), good, *case)


@pytest.mark.long
@pytest.mark.parametrize("name", ALL)
def test_every_field(halves, tmp_path: Path, name: str) -> None:
    half = halves(name)
    good = torch.load(half / "last.pt", weights_only=True)
    cases = [(place, wrong) for place in fields(good) for wrong in WRONG]
    assert len(cases) > 500
    for index, case in enumerate(cases):
        check(half, tmp_path / str(index), good, *case)
        shutil.rmtree(tmp_path / str(index))


@pytest.mark.parametrize("optimizer", [torch.optim.Adam, torch.optim.RMSprop, torch.optim.SGD])
def test_an_optimizers_state_is_held_against_the_optimizer(optimizer: Any) -> None:
    def made(size: int) -> Any:
        weights = torch.nn.Parameter(torch.ones(size))
        result = optimizer([weights], lr=0.1)
        weights.grad = torch.ones(size)
        result.step()
        return result

    new = optimizer([torch.nn.Parameter(torch.ones(4))], lr=0.3)
    check_optimizer(new, new.state_dict())
    check_optimizer(new, made(4).state_dict())
    assert not new.state_dict()["state"], "it is as it was"
    changed = made(4).state_dict()
    changed["param_groups"][0]["weight_decay"] = 1.0
    with pytest.raises(ValueError, match="an optimizer's weight_decay is 1.0"):
        check_optimizer(new, changed)
    changed = made(4).state_dict()
    changed["param_groups"][0]["setting_of_another_torch"] = True
    check_optimizer(new, changed)
    if optimizer is not torch.optim.SGD:  # which has no moments
        with pytest.raises(ValueError, match=r"of shape \(4,\) is expected, not \(3,\)"):
            check_optimizer(new, made(3).state_dict())
