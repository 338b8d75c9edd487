"""The tool that writes tables into the documentation, as a module."""

import importlib.util
from functools import cache
from pathlib import Path
from typing import Any

PLACE = Path(__file__).resolve().parents[2] / "tools/doc_tables.py"


@cache
def tool() -> Any:
    spec = importlib.util.spec_from_file_location("doc_tables", PLACE)
    assert spec is not None and spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found
