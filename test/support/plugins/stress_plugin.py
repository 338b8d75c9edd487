"""The options of the stress tests (test/stress) and the table of their results.

    ./ws test -m stress                                     # all of it, up to an hour; another seed each time
    ./ws test -m stress --stress-seed 7 -k kill             # the same cases again
    ./ws test -m stress --stress-seed 7 -k kill --stress-case 12 -x     # the one that failed

Without `-m stress` only a little of each runs, always the same, so that the code stays alive.
"""

from __future__ import annotations

import datetime
import secrets
import subprocess
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import pytest
from support.stress.scenario import Row, Scenario

LITTLE = 0.0005  # of the full number of cases
ROOT = Path(__file__).resolve().parents[3]
COMMIT = ["git", "describe", "--always", "--abbrev=9", "--dirty=+", "--exclude=*"]
HEAD = """| scenario | cases | failed | seconds | figures | seed | commit | date |
| --- | --- | --- | --- | --- | --- | --- | --- |
"""


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("stress")
    group.addoption("--stress-scale", type=float, help="part of each stress test that is done")
    group.addoption("--stress-seed", type=int, help="of all that stress tests draw")
    group.addoption("--stress-case", type=int, help="the one case of each scenario that is tried")


def is_asked_for(config: pytest.Config) -> bool:
    """Whether this is a stress run, not a run of all tests."""
    return config.option.markexpr == "stress"


def prepare(config: pytest.Config) -> None:
    """Choose what wasn't given; the processes of pytest-xdist get it with the other options."""
    if config.option.stress_scale is None:
        config.option.stress_scale = 1.0 if is_asked_for(config) else LITTLE
    if config.option.stress_seed is None:
        config.option.stress_seed = secrets.randbelow(10**6) if is_asked_for(config) else 0


def pytest_report_header(config: pytest.Config) -> list[str]:
    option = config.option
    if not is_asked_for(config):
        return []
    return [f"stress: --stress-seed {option.stress_seed} --stress-scale {option.stress_scale:g}"]


def deselect_full(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect what is marked `stress(full=True)` unless this is a stress run."""
    if is_asked_for(config):
        return
    marks = ((item, item.get_closest_marker("stress")) for item in items)
    left = [item for item, mark in marks if mark and mark.kwargs.get("full")]
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if item not in left]


@pytest.fixture
def scenario(request: pytest.FixtureRequest) -> Iterator[Scenario]:
    """Random numbers and counters for a stress test."""
    option = request.config.option
    made = Scenario(option.stress_seed, option.stress_scale, option.stress_case)
    yield made
    request.node.user_properties += [("stress", asdict(row)) for row in made.rows]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print the table of a stress run, and write it to .ws/stress/table.md."""
    if not is_asked_for(config):
        return
    option = config.option
    reports = [each for group in terminalreporter.stats.values() for each in group]
    rows = [
        Row(**value)
        for report in reports
        if getattr(report, "when", "") == "teardown"
        for name, value in report.user_properties
        if name == "stress"
    ]
    if not rows:
        return
    asked = subprocess.run(COMMIT, cwd=ROOT, capture_output=True, text=True, check=False)
    when = f"{option.stress_seed} | {asked.stdout.strip() or '?'} | {datetime.date.today()}"
    lines = [
        f"| {row.name} | {row.done:,} | {len(row.failures)} | {row.seconds:.0f}"
        f" | {'; '.join(row.notes)} | {when} |\n"
        for row in rows
    ]
    table = HEAD + "".join(lines)
    (ROOT / ".ws/stress").mkdir(parents=True, exist_ok=True)
    (ROOT / ".ws/stress/table.md").write_text(table)
    terminalreporter.section(f"stress, seed {option.stress_seed}")
    terminalreporter.write(table)
