"""What CI runs: a failed check is named, stops neither other checks nor tests, and fails the run."""

import shutil
import subprocess

import pytest

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
check) echo "{check}"; exit {check_code} ;;
test) echo "{test}"; exit {test_code} ;;
esac
"""


def bash(*command, cwd):
    return subprocess.run(["bash", *command], cwd=cwd, text=True, capture_output=True, check=False)


@pytest.fixture
def check(root):
    script = CHECKS.format(check=root / "tools/ws_check.sh")
    return lambda *names: bash("-c", script, "ws", *names, cwd=root)


def test_all_checks_run_and_those_that_failed_are_named(check):
    done = check()
    assert done.stdout.splitlines() == [
        "== bad: the bad one",
        "wrong",
        "== good: the good one",
        "right",
        "ws check: failed: bad",
    ]
    assert done.returncode == 1


def test_one_check_alone(check):
    done = check("good")
    assert done.stdout.splitlines()[-1] == "ws check: passed: good"
    assert (done.returncode, "wrong" in done.stdout) == (0, False)


def test_an_unknown_check_is_a_usage_error(check):
    done = check("good", "nonsense")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "usage: there is no check 'nonsense', only bad good\n"


@pytest.fixture
def ci(root, tmp_path):
    """Runs .ci/run with a fake ws; returns the exit code and the lines of the output."""
    (tmp_path / ".ci").mkdir()
    shutil.copy(root / ".ci/run", tmp_path / ".ci")

    def run(check, check_code, test, test_code):
        script = tmp_path / "ws"
        script.write_text(
            WS.format(check=check, check_code=check_code, test=test, test_code=test_code)
        )
        script.chmod(0o755)
        done = bash(".ci/run", cwd=tmp_path)
        return done.returncode, done.stdout.splitlines()

    return run


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
