"""Public names of a package whose modules are imported when a name is first used (PEP 562)."""

import ast
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any


def attach(
    package: str, path: Sequence[str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Returns `__getattr__`, `__dir__` and `__all__` of a package, from its imports for type checkers.

    Its public names are what `if TYPE_CHECKING:` imports in `__init__.py` in its `__path__`: in catkin's
    devel space that is another file than its `__file__`.
    """
    places = {
        alias.name: node.module
        for folder in path
        for file in Path(folder).glob("__init__.py")
        for block in ast.parse(file.read_bytes()).body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }

    def get(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if places[name] == package:
            return import_module(f"{package}.{name}")
        return getattr(import_module(places[name]), name)

    return get, lambda: sorted(places), sorted(places)
