"""Where a module defines a name: found without running any of it."""

import ast
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from bullet_gazebo.definitions import defines, find_file

CATKINS = """\
from os import path as os_path
from sys import path as sys_path
from pkgutil import extend_path
__extended_path = '{folders}'.split(';')
for p in reversed(__extended_path):
    sys_path.insert(0, p)
__path__ = extend_path(__path__, __name__)
"""


@pytest.fixture
def source(tmp_path, monkeypatch):
    """Writes modules, each of which notes that it was run."""
    monkeypatch.syspath_prepend(tmp_path)
    ran: list[str] = []
    monkeypatch.setitem(sys.modules, "noting", SimpleNamespace(ran=ran))

    def write(name: str, text: str = "") -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"import noting\nnoting.ran.append(__name__)\n{text}\n")
        return path

    yield write
    assert ran == [], "nothing is imported"


def is_class(definition) -> bool:
    return isinstance(definition, ast.ClassDef)


def is_anything(definition) -> bool:
    return True


@pytest.mark.parametrize(
    "text",
    [
        "class Spring: pass",
        "if noting:\n    class Spring: pass\nelse:\n    Spring = None",
        "try:\n    import numpy\nexcept ImportError:\n    raise\nelse:\n    class Spring: pass",
        "with noting:\n    class Spring: pass",
        "class _Spring: pass\nSpring = _Spring",
        "class _Spring: pass\nSpring: type = _Spring",
    ],
)
def test_a_class_is_found_at_the_top_level(source, text) -> None:
    source("springs_a.py", text)
    assert defines("springs_a", "Spring", is_class)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "Spring = 3",
        "def make():\n    class Spring: pass",
        "class Springs: pass",
        "import Spring",
        "from no_such_module import Spring",
        "from springs_b import Spring",
        "from springs_b import *",
        "Spring = Spring",
        "class Spring(:",
        "\0",
    ],
)
def test_what_is_no_class_of_that_name_is_not_found(source, text) -> None:
    source("springs_b.py", text)
    assert not defines("springs_b", "Spring", is_class)


@pytest.mark.parametrize(
    "line", ["from .parts.coil import Spring", "from springs_c.parts.coil import Coil as Spring",
             "from .parts import *", "from .parts import Spring"],
)  # fmt: skip
def test_it_is_followed_through_a_package(source, line) -> None:
    source("springs_c/__init__.py", line)
    source("springs_c/parts/__init__.py", "from .coil import Spring\nfrom ..parts.coil import Coil")
    source("springs_c/parts/coil.py", "class Spring: pass\nclass Coil: pass")
    assert defines("springs_c", "Spring", is_class)
    assert defines("springs_c.parts.coil", "Coil", is_class)
    assert find_file("springs_c.parts").endswith("springs_c/parts/__init__.py")


def test_catkins_devel_space_stands_for_the_source_folder(source, tmp_path) -> None:
    source("src/my_pkg/__init__.py", "from my_pkg.coil import Spring")
    source("src/my_pkg/coil.py", "class Spring: pass")
    source("my_pkg/__init__.py", CATKINS.format(folders=tmp_path / "src"))
    assert defines("my_pkg", "Spring", is_class)
    assert defines("my_pkg.coil", "Spring", is_class)
    assert not defines("my_pkg", "Coil", is_anything)


@pytest.mark.parametrize(
    "module",
    ["builtins", "sys", "math", "__main__", "__hello__", "no_such_module", "a.b.c", "", ".", "os."],
)
def test_what_has_no_source_defines_nothing(module) -> None:
    assert not defines(module, "exit", is_anything)


def test_modules_of_the_library_are_looked_at_and_not_imported() -> None:
    sys.modules.pop("this", None)
    assert not defines("this", "X", is_anything)
    assert find_file("this").endswith("this.py")
    assert not defines("antigravity", "eval", is_anything)
    assert defines("unittest", "TestCase", is_class)
    assert "this" not in sys.modules and "antigravity" not in sys.modules
