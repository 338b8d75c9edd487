"""Somebody who follows a test run through a pipe sees how far it is, and in which file."""

import re
import subprocess
import sys

import pytest
from support.plugins.progress_plugin import ROSTEST, weight

PLUGIN = "support.plugins.progress_plugin"

TEN_TESTS = """import pytest
@pytest.mark.parametrize("number", range(10))
def test_it(number):
    assert number != {failing}
"""


@pytest.fixture
def run(tmp_path, root):
    """Runs pytest with the plugin on two files of ten tests each; returns its lines."""
    for name, failing in (("test_a.py", 7), ("test_b.py", -1)):
        (tmp_path / name).write_text(TEN_TESTS.format(failing=failing))

    def run(*options):
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-p", PLUGIN, "--rootdir", tmp_path, *options],
            cwd=tmp_path, env={"PYTHONPATH": str(root / "test")}, text=True, check=False,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert done.returncode == 1, done.stdout
        return done.stdout.splitlines()

    return run


def told(lines):
    matches = (re.fullmatch(r"\[ *(\d+) %\] (.+)", line) for line in lines)
    return [(int(match[1]), match[2]) for match in matches if match]


@pytest.mark.parametrize("options", [(), ("-n", "2")], ids=["one process", "two"])
def test_every_file_and_every_few_percent_have_a_line(run, options):
    lines = run(*options)
    progress = told(lines)
    percents = [percent for percent, _ in progress]
    assert percents == sorted(percents)
    assert percents[0] == 0
    assert percents[-1] == 100
    assert max(b - a for a, b in zip(percents, percents[1:], strict=False)) <= 10
    assert {text for _, text in progress} == {
        "test_a.py", "test_b.py", "FAILED test_a.py::test_it[7]",
    }  # fmt: skip
    assert "1 failed, 19 passed" in lines[-1]
    assert not any(set(line) & set("F.") == set(line) for line in lines if line), "rows of dots"


def test_verbose_and_quiet_are_pytests_own(run):
    assert not told(run("-v"))
    assert not told(run("-q"))


def test_a_rostest_counts_for_more():
    assert weight("test/ros/lockstep.test::lockstep@ros") == ROSTEST
    assert weight("test/unit/test_pid.py::test_gains[.test]") == 1
