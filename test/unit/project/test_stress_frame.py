"""The frame of the stress tests: random numbers for each case, failures, the table."""

from dataclasses import asdict

from support.stress import table
from support.stress.scenario import Row, Scenario


def test_a_row_of_the_table() -> None:
    row = Row("soak", 10, done=9, notes=["5 MiB", "no more"], seconds=61.26)
    *_, line = table.render([table.record(row, 7, 1.0)]).splitlines()
    assert line.startswith("| soak | 9 | 0 | 61 | 5 MiB; no more | 7 | ")


def test_each_case_has_random_numbers_of_its_own() -> None:
    drawn: dict[int, float] = {}
    one = Scenario(seed=3, scale=0.5)
    one.run("a", 8, lambda number, dice: drawn.update({number: dice.random()}), lanes=2)
    assert len(set(drawn.values())) == len(drawn) == 4
    Scenario(3, 1.0, only=2).run("a", 8, lambda number, dice: check(dice.random() == drawn[2]))
    Scenario(4, 1.0, only=2).run("a", 8, lambda number, dice: check(dice.random() != drawn[2]))


def check(holds: bool) -> None:
    assert holds


def test_a_case_that_fails_is_told_and_counted() -> None:
    scenario = Scenario(seed=3, scale=1.0)
    try:
        scenario.run("b", 6, lambda number, _: check(number % 2 == 0), unit=10)
    except AssertionError as fault:
        told = str(fault)
    assert "b: 3 failed" in told and "case 5 of seed 3" in told
    row = asdict(scenario.rows[0])
    assert (row["asked"], row["done"], len(row["failures"])) == (60, 60, 3)
