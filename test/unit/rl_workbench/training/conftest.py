"""What the tests of trainings share."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from support.training.training_runs import InterruptAfter, train

SHORT = {"total_timesteps": 120, "eval_frequency": 0}


@pytest.fixture(scope="session")
def counted(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Path, int]]:
    """A small training by its algorithm's name, and how often it asks whether it is interrupted."""

    @cache
    def trained(name: str) -> tuple[Path, int]:
        interrupt = InterruptAfter()
        return train(tmp_path_factory.mktemp("whole") / name, name, interrupt), interrupt.times

    return trained


@pytest.fixture(scope="session")
def whole(counted: Callable[[str], tuple[Path, int]]) -> Callable[[str], Path]:
    """By an algorithm's name: a small training that was never interrupted; not to be changed."""
    return lambda name: counted(name)[0]


@pytest.fixture(scope="session")
def times(counted: Callable[[str], tuple[Path, int]]) -> Callable[[str], int]:
    return lambda name: counted(name)[1]


@pytest.fixture(scope="session")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short training that was never interrupted; not to be changed."""
    return train(tmp_path_factory.mktemp("short"), "dqn", **SHORT)


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    """The same, interrupted after 39 steps."""
    return train(tmp_path / "run", "dqn", InterruptAfter(40), **SHORT)
