"""The pytest fixture `world`; a test that fails with it runs once more, recorded."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from _pytest.runner import runtestprotocol

from ros_utils.testing.bench import failure_folder, process_bench, tell
from ros_utils.testing.robot_world import RobotWorld

RECORDED, SEED = pytest.StashKey[Path](), pytest.StashKey[int]()


def pytest_configure(config: pytest.Config) -> None:
    """Leaves out rospy's own warnings: there are hundreds."""
    config.addinivalue_line("filterwarnings", "ignore:notifyAll:DeprecationWarning")


@pytest.fixture
def world_seed() -> int:
    """The seed of the sensors' noise; a fixture of this name in your tests replaces it."""
    return 1


@pytest.fixture
def world(world_seed: int, request: pytest.FixtureRequest) -> Iterator[RobotWorld]:
    """An empty world at time 0 for each test."""
    stash = request.node.stash
    stash[SEED] = world_seed
    with process_bench().world(world_seed, stash.get(RECORDED, None)) as made:
        yield made


def _failure(reports: list[pytest.TestReport]) -> pytest.TestReport | None:
    return next((each for each in reports if each.failed and each.when != "teardown"), None)


def _message(report: pytest.TestReport) -> str:
    crash = getattr(report.longrepr, "reprcrash", None)
    return str(crash.message if crash else report.longrepr).partition("\n")[0]


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> Any:
    """Runs a test with a world; if it fails, once more, and says where the recording is."""
    if "world" not in getattr(item, "fixturenames", ()) or item.config.getoption("usepdb", False):
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    reports = runtestprotocol(item, log=False, nextitem=nextitem)
    failed = _failure(reports)
    try:
        if failed is not None and SEED in item.stash:
            failed.sections.append(("recording", _record(item, nextitem, failed)))
    finally:  # a Ctrl-C ends the recording, and the failure is told
        for report in reports:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def _record(item: pytest.Item, nextitem: pytest.Item | None, failed: pytest.TestReport) -> str:
    """Runs a test once more, recorded; returns what to say about it."""
    try:
        item.stash[RECORDED] = folder = failure_folder(item.nodeid)
        again = _failure(runtestprotocol(item, log=False, nextitem=nextitem))
        other = "" if again is None else _message(again)
        return tell(folder, item.stash[SEED], failed.longreprtext, _message(failed), other)
    except OSError as fault:
        return f"not recorded: {fault}"
