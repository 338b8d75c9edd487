"""What the tests of trainings share."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from support.training.training_runs import InterruptAfter, train

SHORT = {"total_timesteps": 120, "eval_frequency": 0}


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """By an algorithm's name: a small training that was never interrupted; not to be changed."""

    @cache
    def trained(name: str) -> Path:
        return train(tmp_path_factory.mktemp("whole") / name, name)

    return trained


@pytest.fixture(scope="session")
def times(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], int]:
    """How often a small training asks whether it is interrupted, by its algorithm."""

    @cache
    def counted(name: str) -> int:
        interrupt = InterruptAfter()
        train(tmp_path_factory.mktemp("times") / name, name, interrupt)
        return interrupt.times

    return counted


@pytest.fixture(scope="session")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short training that was never interrupted; not to be changed."""
    return train(tmp_path_factory.mktemp("short"), "dqn", **SHORT)


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    """The same, interrupted after 39 steps."""
    return train(tmp_path / "run", "dqn", InterruptAfter(40), **SHORT)
