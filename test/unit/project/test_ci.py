"""What CI runs: failed checks are named and fail the run; failed tests run once more, alone."""

import shutil
import sys

import pytest
from support.python import run

# Two checks, `bad` fails; sourced as ws does it.
CHECKS = """
set -euo pipefail
ROOT=$PWD VENV=none WS=none
fail_usage() {{ echo "usage: $1" >&2; exit 2; }}
source {check}
CHECKS=(bad good)
CHECK_TITLE=([bad]="the bad one" [good]="the good one")
check_bad() {{ echo wrong; return 3; }}
check_good() {{ echo right; }}
look_for_checks "$@"
check "$@"
"""
PASSED = "== 7 passed, 2 deselected in 1.50s =="
FAILED = "== 1 failed, 5 passed, 1 skipped, 1 xfailed, 2 errors in 61.00s (0:01:01) =="
WS = """#!/usr/bin/env bash
case $1 in
check) echo "{0}"; exit {1} ;;
test)
    shift
    [[ $* == *--last-failed* ]] && {{ echo "{4}"; exit {5}; }}
    echo "{2}"; exit {3} ;;
esac
"""


@pytest.fixture
def check(root):
    script = CHECKS.format(check=root / "tools/ws_check.sh")
    return lambda *names: run(["bash", "-c", script, "ws", *names], cwd=root)


def test_all_checks_run_and_those_that_failed_are_named(check):
    done = check()
    good, bad = ["== good: the good one", "right"], ["== bad: the bad one", "wrong"]
    assert done.stdout.splitlines() == [*bad, *good, "ws check: failed: bad"]
    assert done.returncode == 1


def test_one_check_alone(check):
    done = check("good")
    assert done.stdout.splitlines()[-1] == "ws check: passed: good"
    assert (done.returncode, "wrong" in done.stdout) == (0, False)


@pytest.fixture
def ci(root, tmp_path):
    """Runs .ci/run with a fake ws; returns the exit code and the lines of the output."""
    (tmp_path / ".ci").mkdir()
    shutil.copy(root / ".ci/run", tmp_path / ".ci")

    def ended(check, check_code, test, test_code, again="", again_code=5):
        script = tmp_path / "ws"
        script.write_text(WS.format(check, check_code, test, test_code, again, again_code))
        script.chmod(0o755)
        done = run([".ci/run"], cwd=tmp_path)
        return done.returncode, done.stdout.splitlines()

    return ended


@pytest.mark.parametrize(
    ("check", "test", "code", "last"),
    [
        (("ws check: passed: lint", 0), (PASSED, 0), 0, ["7 passed, 0 failed"]),
        (("ws check: passed: lint", 0), (FAILED, 1), 1, ["6 passed, 3 failed, 1 skipped"]),
        (("ws check: passed: lint", 0), ("no network", 1), 1, ["0 passed, 1 failed"]),
        (
            ("ws check: failed: lint links", 1), (PASSED, 0), 1,
            ["./ws check failed: lint links", "7 passed, 1 failed"],
        ),
        (
            ("no network", 4), (FAILED, 1), 1,
            ["./ws check failed: it ended with exit code 4", "6 passed, 3 failed, 1 skipped"],
        ),
    ],
    ids=["all passes", "a test fails", "the tests can't run", "a check fails", "the checks can't run"],
)  # fmt: skip
def test_the_last_lines_and_the_exit_code(ci, check, test, code, last):
    ended, lines = ci(*check, *test)
    assert (ended, lines[-len(last) :]) == (code, last)


A, B = "test/unit/a.py::test_a[one two]", "test/ros/b.test::b"
BOTH = f"""FAILED {A} - assert 'x - y'
ERROR {B}
== 1 failed, 5 passed, 1 skipped, 1 error in 1s =="""
AT_ITS_END = f"""___ ERROR at teardown of test_a ___
ERROR    rosout:log.py:3 a line of a log
FAILED {A} - assert 1
ERROR {A} - it is left
ERROR {B} - it is left
___ ERROR at teardown of b ___
== 1 failed, 6 passed, 2 errors in 1s =="""
ALL_PASS = f"PASSED {B}\nPASSED {A}\n== 2 passed in 1s =="


@pytest.mark.parametrize(
    ("first", "again", "code", "last"),
    [
        (BOTH, (ALL_PASS, 0), 0, [f"flaky: {B}, {A}", "7 passed, 0 failed, 1 skipped"]),
        (AT_ITS_END, (ALL_PASS, 0), 0, [f"flaky: {B}, {A}", "7 passed, 0 failed"]),
        (
            BOTH, (f"PASSED {B}\nFAILED {A} - assert 'x - y'\n== 1 failed, 1 passed in 1s ==", 1), 1,
            [f"flaky: {B}", "6 passed, 1 failed, 1 skipped"],
        ),
        (
            BOTH, (f"{ALL_PASS}\nERROR {B} - it is left\n== 2 passed, 1 error in 1s ==", 1), 1,
            [f"flaky: {A}", "6 passed, 1 failed, 1 skipped"],
        ),
        (BOTH, (f"PASSED {A}\n== 1 passed, 1 skipped in 1s ==", 0), 1,
            [f"flaky: {A}", "6 passed, 1 failed, 1 skipped"]),
        (BOTH, ("no network", 4), 1, ["no network", "5 passed, 2 failed, 1 skipped"]),
    ],
    ids=["all pass", "both at their end", "one fails", "one at its end", "one is skipped", "no run"],
)  # fmt: skip
def test_what_fails_runs_once_more_and_what_passes_then_is_named(ci, first, again, code, last):
    ended, lines = ci("ws check: passed: lint", 0, first, 1, *again)
    assert (ended, lines[-len(last) :]) == (code, last)


def test_the_second_run_is_alone_and_of_what_failed(root, tmp_path):
    """pytest itself: a test that fails once, one that always does, and one whose process dies."""
    (tmp_path / ".ci").mkdir()
    shutil.copy(root / ".ci/run", tmp_path / ".ci")
    (tmp_path / "test").mkdir()
    (tmp_path / "test/test_it.py").write_text(FLAKY)
    script = tmp_path / "ws"
    script.write_text(
        "#!/usr/bin/env bash\nunset PYTEST_XDIST_WORKER\n[[ $1 == test ]] || exit 0\n"
        "shift; [[ $# -gt 0 ]] || set -- -n 2\n"
        f'exec {sys.executable} -m pytest -p no:randomly -c /dev/null --rootdir . "$@" test\n'
    )
    script.chmod(0o755)
    done = run([".ci/run"], cwd=tmp_path)
    assert done.stdout.splitlines()[-2:] == [
        "flaky: test/test_it.py::test_dies_once, test/test_it.py::test_fails_once",
        "3 passed, 1 failed",
    ]
    assert done.returncode == 1


FLAKY = """
import os, pathlib, pytest

def once(name):
    path = pathlib.Path(name)
    is_first = not path.exists()
    path.touch()
    return is_first

def test_passes():
    assert "PYTEST_XDIST_WORKER" in os.environ

def test_fails_once():
    assert not once("failed")
    assert "PYTEST_XDIST_WORKER" not in os.environ

def test_fails():
    raise AssertionError

def test_dies_once():
    if once("died"):
        os._exit(3)
"""
