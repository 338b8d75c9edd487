"""Seeds what a script may draw from, also what it imports later."""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import random
import secrets
import sys
import types
from collections.abc import Callable, Sequence


def seed_everything(seed: int) -> None:
    """Seeds random and NumPy now, and torch when the script imports it."""
    random.seed(seed)
    draw = random.Random(seed)
    original = secrets.randbits
    # NumPy takes this function for generators that nobody seeds, once, when it is first imported.
    secrets.randbits = draw.getrandbits  # type: ignore[assignment]
    try:
        import numpy
    finally:
        secrets.randbits = original
    numpy.random.seed(seed)
    if "torch" in sys.modules:
        sys.modules["torch"].manual_seed(seed)
    else:
        sys.meta_path.insert(0, AfterImport("torch", lambda torch: torch.manual_seed(seed)))


class AfterImport(importlib.abc.MetaPathFinder):
    """Calls a function with a module when it has been imported."""

    def __init__(self, name: str, call: Callable[[types.ModuleType], object]) -> None:
        self._name = name
        self._call = call

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: types.ModuleType | None = None,
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != self._name:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is None or spec.loader is None:
            return spec
        execute = spec.loader.exec_module

        def executing(module: types.ModuleType) -> None:
            execute(module)
            self._call(module)

        spec.loader.exec_module = executing  # type: ignore[method-assign]
        return spec
