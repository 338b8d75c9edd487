"""The tables in the documentation are those that the code declares."""

import pytest
from support.doc_tables import tool


@pytest.mark.parametrize("name", tool().PAGES)
def test_a_page_has_its_tables(name: str) -> None:
    page = (tool().ROOT / "docs" / name).read_text(encoding="utf-8")
    assert tool().with_tables(name, page) == page, "run ./ws python3 tools/doc_tables.py"
