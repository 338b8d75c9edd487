"""A table that grows, as a page follows it."""

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


def test_rows_come_once_and_whole(place):
    followed = GrowingTable(place.parent)
    assert followed.read().problem == "nothing is written yet"
    place.write_text(HEADER + row(1, 2.5) + row(3, 4.0)[:-4])
    assert followed.read().points == [(1.0, "charts/episodic_return", 2.5)]
    assert followed.read().points == []
    place.write_text(HEADER + row(1, 2.5) + row(3, 4.0))
    look = followed.read()
    assert look.points == [(3.0, "charts/episodic_return", 4.0)]
    assert not look.restarted
    assert not look.problem


def test_any_way_of_cutting_the_file_gives_the_same(place):
    rows = [row(step, step / 3, f"tag{step % 3}") for step in range(200)]
    content = (HEADER + "".join(rows)).encode()
    expected = [(float(step), f"tag{step % 3}", step / 3) for step in range(200)]
    draw = random.Random(7)
    for _ in range(20):
        place.write_bytes(b"")
        followed, found = GrowingTable(place), []
        with place.open("ab", buffering=0) as file:
            for begin, end in _pieces(len(content), draw):
                file.write(content[begin:end])
                look = followed.read()
                assert not look.problem
                found += look.points
        assert found == expected


def _pieces(length, draw):
    cuts = sorted({0, length, *(draw.randrange(length) for _ in range(15))})
    return zip(cuts, cuts[1:], strict=False)


def test_a_resumed_training_cuts_it_back(place):
    place.write_text(HEADER + row(1, 1) + row(2, 2) + row(3, 3))
    followed = GrowingTable(place)
    followed.read()
    os.truncate(place, len(HEADER + row(1, 1)))
    look = followed.read()
    assert look.restarted
    assert [point[0] for point in look.points] == [1.0]


def test_a_folder_that_is_gone_may_come_back(place):
    folder = place.parent / "run"
    folder.mkdir()
    inside = folder / place.name
    inside.write_text(HEADER + row(1, 1))
    followed = GrowingTable(folder)
    assert len(followed.read().points) == 1
    inside.unlink()
    folder.rmdir()
    look = followed.read()
    assert look.problem == "the table is gone"
    assert not look.restarted
    folder.mkdir()
    inside.write_text(HEADER + row(1, 1) + row(2, 2))
    assert [point[0] for point in followed.read().points] == [2.0]


@pytest.mark.parametrize(
    "content", [b"a,b\n1,2\n", b"\x89PNG\r\n" + bytes(100), b"step,tag\n", b"x" * 200]
)
def test_what_is_no_table_is_said(place, content):
    place.write_bytes(content)
    look = GrowingTable(place).read()
    assert look.problem == "this is not a training's table"
    assert not look.points


def test_what_is_no_file_is_said(place):
    os.mkfifo(place)
    assert GrowingTable(place).read().problem == "this is not a file"
    assert GrowingTable(place / "deeper").read().problem


def test_damaged_rows_cost_no_others(place):
    place.write_bytes(
        (HEADER + row(1, 1) + "2,charts\n" + row(3, "nan") + row(4, "inf") + "\n").encode()
        + b"5,\xff\xfe,1.0,2.0\n" + row(6, 6).encode()
    )  # fmt: skip
    assert [point[0] for point in GrowingTable(place).read().points] == [1.0, 6.0]


def test_a_long_one_comes_in_pieces(place, monkeypatch):
    monkeypatch.setattr(table, "CHUNK", 1000)
    place.write_text(HEADER + "".join(row(step, step) for step in range(100)))
    followed, steps, looks = GrowingTable(place), [], 0
    while (look := followed.read()).has_more:
        steps += [point[0] for point in look.points]
        looks += 1
    steps += [point[0] for point in look.points]
    assert steps == list(range(100))
    assert looks > 3
