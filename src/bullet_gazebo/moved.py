"""Old names of modules that moved to `robot_sim`, or out of `bullet_gazebo.ros`."""

import importlib
import sys
import warnings
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec
from types import ModuleType

PLACES = (("bullet_gazebo.ros", "bullet_gazebo"), ("bullet_gazebo", "robot_sim"))


class Moved(MetaPathFinder, Loader):
    """Finds modules by their names of 0.2, and warns where they are.

    It comes before the finder of files, which would load a module of a package that has moved once more.
    """

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Returns the spec of a module that moved; None for any other."""
        if not fullname.startswith("bullet_gazebo."):
            return None
        parent = fullname.rpartition(".")[0]
        is_there = parent in sys.modules and sys.modules[parent].__name__ == parent
        if is_there and PathFinder.find_spec(fullname, path) is not None:
            return None
        place = _place_of(fullname)
        if place is None:
            return None
        warnings.warn(f"{fullname} is {place} now", FutureWarning, stacklevel=2)
        return ModuleSpec(fullname, self, origin=place)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Returns the module itself, so that its classes are the same by both names."""
        module = importlib.import_module(str(spec.origin))
        self._own = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Puts back the spec that the import by the old name has replaced."""
        module.__spec__ = self._own


def _place_of(name: str) -> str | None:
    for old, new in PLACES:
        place = new + name.removeprefix(old)
        if name.startswith(f"{old}.") or name == "bullet_gazebo.ros":
            try:
                if place in sys.modules or find_spec(place) is not None:
                    return place
            except ModuleNotFoundError:  # of a package above it
                continue
    return None
