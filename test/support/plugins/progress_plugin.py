"""Says how far the tests are: a percentage and the running file, on a terminal and in a pipe alike.

Instead of pytest's rows of dots, which with pytest-xdist name no file:

    [  0 %] test/unit/test_pid.py
    [ 37 %] test/ros/lockstep.test
    [ 38 %] FAILED test/unit/test_pid.py::test_the_gains

With -v or -q it leaves pytest's own output alone.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable

import pytest

STEP = 5  # a file that takes longer is named again after so many percent
# What a rostest counts for beside another test, so that percents pass about evenly: it takes about
# 20 s, the others 0.07 s each on average.
ROSTEST = 300


@pytest.hookimpl(trylast=True)  # the reporter has to be there
def pytest_configure(config: pytest.Config) -> None:
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    at_work = hasattr(config, "workerinput")  # a process of pytest-xdist; the first one reports
    if reporter and not at_work and config.get_verbosity() == 0:
        config.pluginmanager.register(Progress(reporter), "progress")


def weight(nodeid: str) -> int:
    """What a test counts for in the percentage."""
    return ROSTEST if file_of(nodeid).endswith(".test") else 1


def file_of(nodeid: str) -> str:
    """The file of a test, relative to the root."""
    return nodeid.partition("::")[0]


class Progress:
    """Counts the tests that have ended, and writes a line when a file starts or percents have passed."""

    def __init__(self, reporter: pytest.TerminalReporter) -> None:
        self._reporter = reporter
        self._reporter.showfspath = False
        self._begun: set[str] = set()  # files
        self._total = 0  # weight of all tests
        self._ended = 0  # weight of those that have ended
        self._told = 0  # the last line's percentage

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self._expect(item.nodeid for item in session.items)

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, node: object, ids: list[str]) -> None:
        self._expect(ids)  # all processes collect the same tests

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        file = file_of(nodeid)
        if file not in self._begun:
            self._begun.add(file)
            self._tell(file)

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        self._ended += weight(nodeid)
        if self._percent() >= self._told + STEP:
            self._tell(file_of(nodeid))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self._tell(f"{'FAILED' if report.when == 'call' else 'ERROR'} {report.nodeid}")

    @pytest.hookimpl(wrapper=True)
    def pytest_report_teststatus(
        self,
    ) -> Generator[None, tuple[str, str, str], tuple[str, str, str]]:
        category, _, word = yield
        return category, "", word  # without the letter of the row

    def _expect(self, nodeids: Iterable[str]) -> None:
        self._total = sum(map(weight, nodeids))

    def _percent(self) -> int:
        return 100 * self._ended // max(self._total, 1)

    def _tell(self, text: str) -> None:
        self._told = self._percent()
        self._reporter.write_line(f"[{self._told:3} %] {text}")
        self._reporter.flush()
