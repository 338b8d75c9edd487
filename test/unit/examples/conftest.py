"""The examples: as modules, and as programs beside a master of their own."""

import importlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from support.python import run

from ros_utils.simulation import reserved_port

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@pytest.fixture
def imported(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], ModuleType]:
    """Imports an example by its name."""
    monkeypatch.syspath_prepend(EXAMPLES)
    return importlib.import_module


@pytest.fixture
def printed() -> Callable[..., str]:
    """Runs Python with arguments, of which an example is its name; returns what it prints."""

    def call(*words: object, **variables: str) -> str:
        examples = [EXAMPLES / each for each in map(str, words)]
        words = [file if file.is_file() else word for file, word in zip(examples, words, strict=True)]
        own = {"ROS_MASTER_URI": f"http://127.0.0.1:{reserved_port()}", **variables}
        ended = run([sys.executable, *words], env={**os.environ, **own})
        assert ended.returncode == 0, ended.stdout + ended.stderr
        return ended.stdout

    return call
