"""Public names that are imported when they are first used."""

import importlib
import sys

import pytest

LAZY = """
from typing import TYPE_CHECKING
from file_access.lazy import attach
if TYPE_CHECKING:
    from fractions import Fraction
    from my_lazy import part as part
__getattr__, __dir__, __all__ = attach(__name__, __path__)
"""


@pytest.mark.parametrize("relayed", [False, True], ids=["", "catkin's devel space"])
def test_a_name_is_imported_when_it_is_used(tmp_path, monkeypatch, relayed):
    source = tmp_path / "src/my_lazy"
    source.mkdir(parents=True)
    (source / "__init__.py").write_text(LAZY)
    (source / "part.py").write_text("")
    found = source.parent
    if relayed:
        found = tmp_path / "devel"
        (found / "my_lazy").mkdir(parents=True)
        (found / "my_lazy/__init__.py").write_text(
            f"__path__.append({str(source)!r})\nexec(open({str(source / '__init__.py')!r}).read())"
        )
    monkeypatch.syspath_prepend(found)
    module = importlib.import_module("my_lazy")
    try:
        assert module.__all__ == dir(module) == ["Fraction", "part"]
        assert "my_lazy.part" not in sys.modules
        assert module.Fraction(1, 2) == 0.5
        assert module.part.__name__ == "my_lazy.part"
        with pytest.raises(AttributeError, match="'my_lazy' has no attribute 'other'"):
            _ = module.other
    finally:
        for name in ("my_lazy", "my_lazy.part"):
            sys.modules.pop(name, None)
