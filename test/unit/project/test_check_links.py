"""tools/check_links.py finds broken links and paths in the documentation."""

import runpy

import pytest

README = """# The house

See [a page](docs/a.md), [its end](docs/a.md#the-end-for-now) and [outside](https://example.com/x.md).
`docs/a.md` and `docs/PAGE.md` are names; so is `docs/<page>.md`.

    [code](is/no/link.md)
"""
PAGE = """# A

## The end, *for now*!

## The end, *for now*!

[back](../README.md#the-house), [second end](#the-end-for-now-1), ![picture](a.png), `[no](link.md)`

```
[no](link.md)
```
"""


@pytest.fixture
def check(root):
    """The faults that the check finds below a folder."""
    faults = runpy.run_path(str(root / "tools/check_links.py"))["faults"]
    return lambda folder: list(faults(folder))


@pytest.fixture
def house(tmp_path):
    """A folder whose documentation is in order."""
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text(README)
    (tmp_path / "docs/a.md").write_text(PAGE)
    (tmp_path / "docs/a.png").touch()
    return tmp_path


def test_good_documentation_passes(check, house):
    assert check(house) == []


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("[x](b.md)", "(b.md) leads nowhere"),
        ("![x](b.png)", "(b.png) leads nowhere"),
        ("[x](../../b.md)", "(../../b.md) leads nowhere"),
        ("[x](../README.md#no-such)", "(../README.md#no-such) leads to no heading"),
        ("[x](#no-such)", "(#no-such) leads to no heading"),
        ("[x](a.png#the-house)", "(a.png#the-house) leads to no heading"),
        ("Look at `docs/old.py`.", "`docs/old.py` isn't there"),
        ("Call\n\n    python3 docs/old.py\n", "`docs/old.py` isn't there"),
        ("```sh\npython3 docs/old.py\n```", "`docs/old.py` isn't there"),
    ],
)
def test_a_fault_is_named_with_its_page(check, house, text, fault):
    page = house / "docs/a.md"
    page.write_text(f"{PAGE}\n{text}\n")
    assert check(house) == [f"docs/a.md: {fault}"]


def test_a_page_that_nobody_finds_is_named(check, house):
    (house / "docs/b.md").write_text("# B\n\n[a](a.md)\n")
    assert check(house) == ["docs/b.md: no links lead there from README.md"]
    (house / "docs/a.md").write_text(f"{PAGE}\n[b](b.md)\n")
    assert check(house) == []


def test_the_changelog_may_name_what_is_gone(check, house):
    (house / "CHANGELOG.md").write_text("`docs/old.py` is gone.\n[x](docs/old.py)\n")
    assert check(house) == ["CHANGELOG.md: (docs/old.py) leads nowhere"]
