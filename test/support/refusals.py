"""Errors of one line."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from robot_sim.physics.description import DescriptionError


@contextmanager
def refused(*texts: str, error: type[Exception] = DescriptionError) -> Iterator[None]:
    """The block raises an error of one line with these texts."""
    with pytest.raises(error) as raised:
        yield
    said = str(raised.value)
    assert "\n" not in said
    assert [text for text in texts if text not in said] == [], said
