"""A table that grows, as a search follows it."""

import os
import random

import pytest

from web_viewer import table
from web_viewer.table import GrowingTable

HEADER = "step,tag,value,wall_time\n"


def row(step, value, tag="charts/episodic_return"):
    return f"{step},{tag},{float(value)!r},1700000000.125\n"


@pytest.fixture
def place(tmp_path):
    return tmp_path / "scalars.csv"


def steps(followed):
    return [point[0] for point in followed.read().points]


def test_any_way_of_cutting_the_file_gives_the_same(place):
    rows = [row(step, step / 3, f"tag{step % 3}") for step in range(200)]
    content = (HEADER + "".join(rows)).encode()
    expected = [(float(step), f"tag{step % 3}", step / 3) for step in range(200)]
    draw = random.Random(7)
    for _ in range(20):
        place.unlink(missing_ok=True)
        followed = GrowingTable(place.parent)
        found = followed.read().points
        cuts = sorted({0, len(content), *(draw.randrange(len(content)) for _ in range(15))})
        with place.open("ab", buffering=0) as file:
            for begin, end in zip(cuts, cuts[1:], strict=False):
                file.write(content[begin:end])
                found += followed.read().points
        assert found == expected


def test_a_resumed_training_cuts_it_back(place):
    place.write_text(HEADER + row(1, 1) + row(2, 2) + row(3, 3))
    followed = GrowingTable(place.parent)
    assert steps(followed) == [1.0, 2.0, 3.0]
    os.truncate(place, len(HEADER + row(1, 1)))
    assert steps(followed) == [1.0]


def test_one_that_is_gone_may_come_back(place):
    place.write_text(HEADER + row(1, 1))
    followed = GrowingTable(place.parent)
    assert steps(followed) == [1.0]
    place.unlink()
    assert steps(followed) == []
    place.write_text(HEADER + row(1, 1) + row(2, 2))
    assert steps(followed) == [2.0]


def test_what_is_no_table_has_no_rows(place):
    place.write_bytes(b"\x89PNG\r\n" + bytes(100))
    assert steps(GrowingTable(place.parent)) == []
    place.unlink()
    os.mkfifo(place)
    assert steps(GrowingTable(place.parent)) == []


def test_damaged_rows_cost_no_others(place):
    place.write_bytes(
        (HEADER + row(1, 1) + "2,charts\n" + row(3, "nan") + row(4, "inf") + "\n").encode()
        + b"5,\xff\xfe,1.0,2.0\n" + row(6, 6).encode()
    )  # fmt: skip
    assert steps(GrowingTable(place.parent)) == [1.0, 6.0]


def test_a_long_one_comes_in_pieces(place, monkeypatch):
    monkeypatch.setattr(table, "CHUNK", 1000)
    place.write_text(HEADER + "".join(row(step, step) for step in range(100)))
    followed, found, looks = GrowingTable(place.parent), [], 0
    while (look := followed.read()).has_more:
        found += look.points
        looks += 1
    assert [point[0] for point in found + look.points] == list(range(100))
    assert looks > 3
