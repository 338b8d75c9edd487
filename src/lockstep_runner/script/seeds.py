"""Seeds what a script may draw from, also what it imports later."""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import random
import sys
import types
from collections.abc import Callable, Sequence

import numpy


def seed_everything(seed: int) -> None:
    """Seeds random and NumPy now, and torch when the script imports it."""
    random.seed(seed)
    numpy.random.seed(seed)
    # What generators begin with that nobody seeds, as Gymnasium's of an environment
    vars(numpy.random.bit_generator)["randbits"] = random.Random(seed).getrandbits
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
