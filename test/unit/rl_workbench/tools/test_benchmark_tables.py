"""The table of a benchmark: what it tells of seeds that never solve, are missing, or lack a line."""

import pytest

from rl_workbench.tools.benchmark.results import RunResult
from rl_workbench.tools.benchmark.tables import RESULTS_SUMMARY, grouped, summary_table

pytestmark = pytest.mark.usefixtures("signals")


def row(seed: int, score: float | None, step: int | None, fault: str = "") -> RunResult:
    return RunResult(
        "a", seed, "run", score, final=score, evaluations=score, solved_step=step, seconds=1.0,
        fault=fault,
    )  # fmt: skip


def summarised(rows: list[RunResult], line: float | None) -> str:
    return summary_table(grouped(rows), RESULTS_SUMMARY, {"a": line}).splitlines()[2]


def test_seeds_that_never_solve_count_as_never() -> None:
    rows = [row(0, 475.0, 100), row(1, 500.0, 300), row(2, 20.0, None)]
    line = summarised(rows, 475.0)
    assert "| a | 2 of 3 |" in line and "| 300 | never |" in line


def test_a_statistic_tells_how_many_seeds_it_lacks() -> None:
    rows = [row(0, 480.0, 100), row(1, 500.0, 300), row(2, None, None, "the loss is nan")]
    cells = summarised(rows, 475.0).split(" | ")
    assert cells[1] == "2 of 3, 1 failed" and cells[2] == "490.0 ± 14.1 (2 of 3)"
    assert all(cell.endswith(" (2 of 3)") for cell in cells[3:6])


def test_where_there_is_no_line_nobody_has_missed_it() -> None:
    line = summarised([row(0, 5.0, None), row(1, 6.0, None)], None)
    assert "never" not in line and line.startswith("| a | - |")


def test_a_variant_without_any_run_has_a_line_of_its_own() -> None:
    line = summarised([RunResult("a", 0, "run", fault="no run folder")], None)
    assert line == "| a | 0 of 1, 1 failed | - | - | - | - | - | - |"
