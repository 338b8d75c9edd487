"""Where a Python module defines a name: found in the source, of which nothing is run.

Importing a module runs it. Who may name a class of a user's, in a parameter say, could else have any module
run that Python finds.
"""

import ast
import sys
from collections.abc import Callable, Iterator
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import NamedTuple

Definition = ast.ClassDef | ast.FunctionDef | ast.expr
Fits = Callable[[Definition], bool]
CATKINS = "__extended_path"  # in the module that catkin puts in place of one in a source folder


def find_file(module: str) -> str | None:
    """Returns the file that importing a module would run, if there is one."""
    spec = _Finder().spec(module)
    return spec.origin if spec is not None and spec.has_location else None


def defines(module: str, name: str, fits: Fits) -> bool:
    """Whether a module has a definition of that name that fits, its own or one that it imports by name.

    Args:
        module: its full name.
        name: of a class, a function or a variable at its top level.
        fits: is asked of a class, a function, or of what a variable is set to.
    """
    return _Search(fits).finds(module, name)


class _Source(NamedTuple):
    """A module's text, read as Python."""

    tree: ast.Module
    package: str  # what its relative imports are relative to


class _Search:
    """Follows a name from module to module."""

    def __init__(self, fits: Fits) -> None:
        self._fits = fits
        self._finder = _Finder()
        self._seen: set[tuple[str, str]] = set()

    def finds(self, module: str, name: str) -> bool:
        if (module, name) in self._seen:
            return False
        self._seen.add((module, name))
        return any(
            self._binds(statement, module, name, source.package)
            for source in self._finder.sources(module)
            for statement in _top_level(source.tree.body)
        )

    def _binds(self, statement: ast.stmt, module: str, name: str, package: str) -> bool:
        match statement:
            case ast.ClassDef() | ast.FunctionDef():
                return statement.name == name and self._fits(statement)
            case ast.Assign(targets=targets, value=value):
                return any(map(_is(name), targets)) and self._is_set(value, module)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                return _is(name)(target) and self._is_set(value, module)
            case ast.ImportFrom(names=names):
                origin = _absolute(statement, package)
                there = {each.name for each in names if name == (each.asname or each.name)}
                there |= {name for each in names if each.name == "*"}
                return any(self.finds(origin, each) for each in there)
        return False

    def _is_set(self, value: ast.expr, module: str) -> bool:
        return self.finds(module, value.id) if isinstance(value, ast.Name) else self._fits(value)


def _is(name: str) -> Callable[[ast.expr], bool]:
    return lambda target: isinstance(target, ast.Name) and target.id == name


def _top_level(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """The statements of a module, those within ``if``, ``try`` and ``with`` too."""
    for statement in body:
        yield statement
        if isinstance(statement, (ast.If, ast.Try, ast.With)):
            for inner in ("body", "orelse", "finalbody"):
                yield from _top_level(getattr(statement, inner, []))
            for handler in getattr(statement, "handlers", []):
                yield from _top_level(handler.body)


def _absolute(statement: ast.ImportFrom, package: str) -> str:
    """The full name of the module that a statement imports from."""
    if statement.level == 0:
        return statement.module or ""
    parts = package.split(".")
    kept = parts[: len(parts) - statement.level + 1]
    return ".".join([*kept, *([statement.module] if statement.module else [])])


class _Finder:
    """Finds modules as Python's import does, but doesn't import the packages that they are in."""

    def spec(self, module: str) -> ModuleSpec | None:
        """What importing the module would load; None if that is no name of one, too."""
        if not all(part.isidentifier() for part in module.split(".")):
            return None
        path: list[str] | None = None
        spec = None
        name = ""
        for part in module.split("."):
            name = f"{name}.{part}" if name else part
            spec = _ask_finders(name, path)
            if spec is None:
                return None
            path = list(spec.submodule_search_locations or [])
            path += [str(Path(folder, part)) for folder in _catkins_folders(_tree(spec))]
        return spec

    def sources(self, module: str) -> list[_Source]:
        """The module's source; of one of catkin's, also the source that it runs."""
        spec = self.spec(module)
        if spec is None:
            return []
        is_package = spec.submodule_search_locations is not None
        package = module if is_package else module.rpartition(".")[0]
        tree = _tree(spec)
        behind = [
            _parsed(path.read_bytes())
            for folder in _catkins_folders(tree)
            for path in (Path(folder, f"{module}.py"), Path(folder, module, "__init__.py"))
            if path.is_file()
        ]
        return [_Source(each, package) for each in (tree, *behind)]


def _ask_finders(name: str, path: list[str] | None) -> ModuleSpec | None:
    for finder in sys.meta_path:
        spec = finder.find_spec(name, path)
        if spec is not None:
            return spec
    return None


def _tree(spec: ModuleSpec) -> ast.Module:
    """The module's source; an empty one where there is none, as of what is compiled."""
    get_source = getattr(spec.loader, "get_source", None)
    try:
        text = get_source(spec.name) if get_source is not None else None
    except (ImportError, OSError):
        return _parsed("")
    return _parsed(text or "")


def _parsed(text: str | bytes) -> ast.Module:
    try:
        return ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # no import gets further
        return ast.parse("")


def _catkins_folders(tree: ast.Module) -> list[str]:
    """The source folders that a module of catkin's devel space stands for."""
    for statement in tree.body:
        match statement:
            case ast.Assign(
                targets=[ast.Name(id=name)],
                value=ast.Call(func=ast.Attribute(value=ast.Constant(value=str(text)))),
            ) if name == CATKINS:
                return text.split(";")
    return []
