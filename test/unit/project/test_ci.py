"""What CI runs: a failed check is named, stops neither other checks nor the tests, and fails the run.

The workflow of the public CI, which nobody can run here, is read, and its trainings are run in short.
"""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

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
    """Runs .ci/run where ws says what the arguments tell; returns its exit code and lines."""
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


def test_when_all_passes(ci):
    code, lines = ci("ws check: passed: lint", 0, PASSED, 0)
    assert (code, lines[-1]) == (0, "7 passed, 0 failed")


def test_a_failed_test_fails_the_run(ci):
    code, lines = ci("ws check: passed: lint", 0, FAILED, 1)
    assert (code, lines[-1]) == (1, "6 passed, 3 failed, 1 skipped")


def test_a_failed_check_is_named_after_the_tests(ci):
    code, lines = ci("ws check: failed: lint links", 1, PASSED, 0)
    assert code == 1
    assert lines[-3:] == [PASSED, "./ws check failed: lint links", "7 passed, 1 failed"]


def test_a_check_that_could_not_run_fails_the_run_as_well(ci):
    code, lines = ci("no network", 4, FAILED, 1)
    assert code == 1
    assert lines[-2:] == [
        "./ws check failed: it ended with exit code 4",
        "6 passed, 3 failed, 1 skipped",
    ]


def test_tests_that_could_not_run_are_a_failure(ci):
    code, lines = ci("ws check: passed: lint", 0, "no network", 1)
    assert (code, lines[-1]) == (1, "0 passed, 1 failed")


# --- the workflow of the public CI ------------------------------------------------------------

KEYS = {"runs-on", "container", "timeout-minutes", "steps"}
ACTIONS = {
    "actions/checkout@v4": set(),
    "actions/setup-python@v5": {"python-version"},
    "actions/upload-artifact@v4": {"name", "path", "include-hidden-files"},
}


WORKFLOWS = sorted((Path(__file__).resolve().parents[3] / ".github/workflows").iterdir())


def read(path):
    return yaml.load(path.read_text(), yaml.BaseLoader)  # `on` is no boolean there


@pytest.fixture(scope="module")
def workflow(root):
    return read(root / ".github/workflows/ci.yml")


def commands(job):
    return [shlex.split(step["run"]) for step in job["steps"] if "run" in step]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_a_workflow_is_one(path):
    workflow = read(path)
    assert set(workflow) == {"name", "on", "permissions", "jobs"}
    assert set(workflow["on"]) <= {"push", "pull_request", "schedule", "workflow_dispatch"}
    for job in workflow["jobs"].values():
        assert set(job) <= KEYS and {"runs-on", "timeout-minutes", "steps"} <= set(job)
        assert job["steps"][0] == {"uses": "actions/checkout@v4"}
        for step in job["steps"]:
            assert ("uses" in step) != ("run" in step)
            if "uses" in step:
                assert set(step.get("with", {})) <= ACTIONS[step["uses"]]
                assert set(step) <= {"uses", "with", "if"}
            assert set(step) <= {"uses", "with", "if", "run", "working-directory"}


def test_the_workflow_has_the_machines_that_are_promised(workflow, root):
    readme = (root / "README.md").read_text()
    for name in ("checks", "readme"):
        system, version = workflow["jobs"][name]["container"].split(":")
        assert f"{system.title()} {version}" in readme
    (python,) = [step["with"] for step in workflow["jobs"]["wheel"]["steps"] if "with" in step]
    wanted = re.search(r'requires-python = ">=(.*)"', (root / "pyproject.toml").read_text())[1]
    assert python["python-version"] == wanted
    assert f"Python {wanted}" in readme


@pytest.mark.slow
def test_the_commands_of_the_workflow(workflow, root, tmp_path, monkeypatch):
    """Those of the checkout are known to ws; those that train do so, without ROS."""
    monkeypatch.chdir(tmp_path)

    def run(script: str, *arguments: str) -> None:
        """In a process of its own: one that trains over ROS stays a node."""
        subprocess.run([sys.executable, str(root / "scripts" / script), *arguments], check=True)

    trained = 0
    for words in [words for job in workflow["jobs"].values() for words in commands(job)]:
        if words[:4] == ["./ws", "rosrun", "cartpole", "pg_train.py"]:
            run("pg_train.py", *words[4:], "--backend=bullet")
            trained += 1
        elif words[0] == "cartpole-pg":
            run("pg_train.py", *words[1:])
            trained += 1
        elif words[0] == "rl-workbench":
            run("workbench.py", *words[1:])
            trained += 1
        elif words[0] == "test":
            assert Path(words[2]).stat().st_size > 0
        else:
            assert words[:2] in (
                ["./ws", "check"],
                ["./ws", "test"],
                ["pip", "wheel"],
                ["pip", "install"],
            )
    assert trained == 3
