"""Old names of modules that moved to `robot_sim`, or out of `bullet_gazebo.ros`."""

from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.util import find_spec
from types import ModuleType

PLACES = (("bullet_gazebo.ros", "bullet_gazebo"), ("bullet_gazebo", "robot_sim"))


class OldNames(MetaPathFinder):
    """Finds nothing, and says where modules are that no other finder knows by their names of 0.2."""

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> None:
        """Raises ModuleNotFoundError for a module that moved; else returns None."""
        for old, new in PLACES:
            place = new + fullname.removeprefix(old)
            if f"{fullname}.".startswith(f"{old}.") and _is_there(place):
                raise ModuleNotFoundError(f"{fullname} is {place} now")  # a name would have it dropped


def _is_there(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ModuleNotFoundError:  # of a package above it
        return False
