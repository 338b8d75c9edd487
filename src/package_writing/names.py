"""Names of packages: catkin's and Python's at once, and not taken."""

import importlib.util
import keyword
import re

from package_writing.errors import CannotWrite

VALID = re.compile(r"[a-z][a-z0-9_]*")


def check_name(name: str) -> None:
    """Makes sure that a package can have this name.

    Raises:
        CannotWrite: if not; it tells one that can be used.
    """
    if VALID.fullmatch(name) and not keyword.iskeyword(name):
        if _is_taken(name):
            raise CannotWrite(f"the name '{name}' is taken: {_other(name)}")
        return
    why = "is a word of Python's" if keyword.iskeyword(name) else "has other signs"
    raise CannotWrite(
        "a package is named with small letters, digits and _, and begins with a letter; "
        f"'{name}' {why}: {_other(name)}"
    )


def _other(name: str) -> str:
    """The nearest name that can be used, told."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    near = re.sub(r"[^a-z0-9]+", "_", words).strip("_") or "robot"
    tried = (near, f"my_{near}", *(f"my_{near}_{number}" for number in range(2, 10)))
    free = (
        each
        for each in tried
        if VALID.fullmatch(each) and not keyword.iskeyword(each) and not _is_taken(each)
    )
    return f"'{next(free, 'my_robot')}' would do"


def _is_taken(name: str) -> bool:
    """Whether a package or a Python module has it."""
    if importlib.util.find_spec(name) is not None:
        return True
    if importlib.util.find_spec("rospkg") is None:
        return False
    import rospkg

    return name in rospkg.RosPack().list()
