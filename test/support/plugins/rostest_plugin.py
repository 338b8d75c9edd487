"""Collects rostest files as pytest items, so that one command runs and counts all tests.

Every `test/ros/*.test` becomes one item. It passes when rostest ends with exit code 0 *and* its
result files hold at least one test and no failure: rostest alone has been seen to report success
when a test process died before it wrote its results.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

ROSTEST = "/usr/bin/rostest"
TESTS = str(Path(__file__).resolve().parents[2])
DEFAULT_TIME_LIMIT = 60.0  # of a <test>, as in rostest [s]
MARGIN = 60.0  # for the master and the nodes to start and stop [s]
GRACE = 30.0  # for rostest to end its nodes after an interrupt [s]


class RostestFailure(Exception):
    """A rostest failed; the text says how."""


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    if file_path.suffix == ".test" and "ros" in (each.name for each in file_path.parents):
        return RostestFile.from_parent(parent, path=file_path)
    return None


class RostestFile(pytest.File):
    """A launch file with <test> elements."""

    def collect(self) -> Iterator[pytest.Item]:
        item = RostestItem.from_parent(self, name=self.path.stem)
        item.add_marker(pytest.mark.rostest)
        yield item


class RostestItem(pytest.Item):
    """One run of one rostest file, with a master and a results folder of its own."""

    def runtest(self) -> None:
        folder = self.config._tmp_path_factory.mktemp(f"rostest-{self.name}")
        run(self.path, folder)

    def repr_failure(self, excinfo, style=None):
        if isinstance(excinfo.value, RostestFailure):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self):
        return self.path, None, f"rostest {self.path.name}"


def run(path: Path, folder: Path) -> None:
    """Run a rostest file; raise RostestFailure unless all of its tests passed.

    Output, ROS logs and results lie below `folder`.
    """
    results, log = folder / "results", folder / "output.txt"
    environment = os.environ | {
        "ROS_TEST_RESULTS_DIR": str(results),
        "ROS_LOG_DIR": str(folder / "log"),
        "ROS_HOME": str(folder / "home"),
        # For support.
        "PYTHONPATH": os.pathsep.join([TESTS, *filter(None, [os.environ.get("PYTHONPATH")])]),
    }
    limit = time_limit(path)
    with log.open("wb") as output:
        process = subprocess.Popen(
            [ROSTEST, str(path)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=environment,
            start_new_session=True,
        )
        try:
            code = process.wait(limit)
        except subprocess.TimeoutExpired:
            raise RostestFailure(f"{path.name}: no end after {limit:.0f} s\n{tail(log)}") from None
        finally:
            end(process)
    problems = read_results(results)
    if code != 0:
        problems.append(f"rostest ended with exit code {code}")
    if problems:
        raise RostestFailure("\n".join([f"{path.name}:", *problems, "", tail(log)]))


def time_limit(path: Path) -> float:
    """Return how long a file may take: its tests one after the other, and a margin [s]."""
    tests = ElementTree.parse(path).iter("test")
    each = (
        float(test.get("time-limit", DEFAULT_TIME_LIMIT)) * (1 + int(test.get("retry", 0))) for test in tests
    )
    return sum(each) + MARGIN


def read_results(folder: Path) -> list[str]:
    """Return what is wrong in rostest's result files, nothing when all tests passed."""
    problems, passed = [], 0
    for file in sorted(folder.rglob("*.xml")):
        try:
            cases = list(ElementTree.parse(file).iter("testcase"))
        except ElementTree.ParseError as error:
            problems.append(f"{file.name} can't be read: {error}")
            continue
        for case in cases:
            texts = [
                f"{case.get('classname')}.{case.get('name')}: {kind}\n{problem.text or ''}"
                for kind in ("failure", "error")
                for problem in case.iter(kind)
            ]
            problems += texts
            # The file rostest-*.xml only repeats whether each test node left its results.
            passed += not texts and not file.name.startswith("rostest-")
    if not passed and not problems:
        problems.append("no test was executed, or none left its results")
    return problems


def tail(log: Path, lines: int = 60) -> str:
    return "\n".join(log.read_text(errors="replace").splitlines()[-lines:])


def end(process: subprocess.Popen) -> None:
    """End rostest and what it started; roslaunch puts each node into a session of its own."""
    if process.poll() is not None:
        return
    started = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(signal.SIGINT)
    try:
        process.wait(GRACE)
    except subprocess.TimeoutExpired:
        for each in started:
            with contextlib.suppress(psutil.NoSuchProcess):
                each.kill()
        process.kill()
        process.wait()
