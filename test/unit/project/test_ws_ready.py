"""`ws` makes a checkout ready: what it prints before, meanwhile and on failure."""

from __future__ import annotations

import os
import re
import subprocess

import pytest

# Debian's tools on a machine where two packages are missing, as a file says.
TOOLS = {
    "dpkg-query": 'cat "$STATE_FILE"\n',
    "apt-get": """
case $* in
*--print-uris*)
    echo "0 upgraded, 12 newly installed, 0 to remove and 3 not upgraded."
    echo "Need to get 34.5 MB of archives."
    echo "After this operation, 120 MB of additional disk space will be used." ;;
*"install --yes"*)
    echo "Get:1 http://deb.example one 1.2 [5 kB]"
    if [[ -n ${BROKEN-} ]]; then echo "E: Failed to fetch http://deb.example/one.deb"; exit 100; fi
    printf 'installed %s\\n' one two >"$STATE_FILE" ;;
esac
""",
    "sudo": 'if [[ $1 == -n ]]; then shift; fi; exec "$@"\n',
    "df": 'printf "Avail\\n%s\\n" "${FREE-9000M}"\n',
}


def test_two_checkouts_have_two_masters(ws, checkout, root):
    def line(result):
        return next(text for text in result.stdout.splitlines() if "http://" in text)

    assert line(ws("--help")) != line(ws("--help", script=checkout / "ws"))


def test_clean_removes_what_ws_made(ws, checkout):
    (checkout / ".ws/log").mkdir(parents=True)
    assert ws("clean", script=checkout / "ws").returncode == 0
    assert not (checkout / ".ws").exists()
    assert (checkout / "requirements/base.txt").exists()


# --- what it says ------------------------------------------------------------------------------


@pytest.fixture
def debian(tmp_path, checkout):
    """The environment of a machine that lacks two Debian packages, which the checkout wants."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name, text in TOOLS.items():
        (folder / name).write_text(f"#!/bin/bash\n{text}")
        (folder / name).chmod(0o755)
    state = tmp_path / "state"
    state.touch()
    (checkout / "companions/broken").mkdir(parents=True)
    (checkout / "companions/broken/package.xml").write_text("<package/>")
    (checkout / "requirements/debian.txt").write_text("one\ntwo\n")
    (checkout / "requirements/ros.txt").write_text("")
    (checkout / "requirements/base.txt").write_text("# Size: 1 kB to fetch\n./no-such-folder\n")
    return {"PATH": f"{folder}:/usr/bin:/bin", "STATE_FILE": str(state), "CARTPOLE_TORCH": "pip"}


def lines(result):
    return [line.removeprefix("ws: ") for line in result.stderr.splitlines()]


@pytest.mark.slow
def test_the_plan_comes_first_and_a_second_call_goes_on(ws, checkout, debian):
    first = ws("true", script=checkout / "ws", BROKEN="yes", **debian)
    place = re.search("in (.*/.ws);", first.stderr)[1]
    assert first.returncode == 1
    assert first.stdout == ""
    assert [re.sub(r"after \d+ s", "after 0 s", line) for line in lines(first)[1:]] == [
        "[1/4] Debian packages: 12 packages, 34.5 MB to fetch, 120 MB on the disk",
        "[2/4] Python packages: 1 kB to fetch",
        "[3/4] catkin workspace of the companions: 1 package",
        "[4/4] catkin workspace: 3 packages",
        f"[1/4] Debian packages ... (log: {place}/log/debian.log)",
        "[1/4] Debian packages: failed after 0 s (exit code 100): "
        "E: Failed to fetch http://deb.example/one.deb",
        "what to do: check the network and the free disk space; on other systems than Debian 12 and 13 "
        f"see docs/catkin.md; then call ws again, which continues from here (log: {place}/log/debian.log)",
    ]

    second = ws("true", script=checkout / "ws", FREE="3M", **debian)
    assert second.returncode == 1
    told = "\n".join(lines(second))
    assert "[1/4] Debian packages: done in " in told
    assert re.search(
        r"\[2/4\] Python packages: failed after \d+ s \(exit code 1\): ERROR: .*no-such-folder", told
    )
    assert "; its disk has 3 MB left\n" in told

    (checkout / "requirements/base.txt").write_text("")
    third = ws("true", script=checkout / "ws", **debian)
    assert "Debian" not in third.stderr, "what was ready is not made again"
    assert "[1/3] Python packages: done in " in third.stderr
    assert third.returncode == 1, "there is nothing in this checkout that could be built"
    assert "[2/3] catkin workspace of the companions: failed" in third.stderr
    assert "mend what the compiler or CMake complains of" in third.stderr

    fourth = ws("true", script=checkout / "ws", **debian)
    assert "Python packages" not in fourth.stderr


STEPS = """
set -euo pipefail
ROOT=$PWD CHECKOUT=$PWD CHECKSUM=1 HOME=$PWD
is_plain() {{ true; }}
source {tools}/ws_place.sh
source {tools}/ws_ready.sh
PERIOD=0.1
declare -A TITLE=([one]="the step") REMEDY=([one]="nothing")
key_one() {{ echo 1; }}
plan_one() {{ echo "not much"; }}
make_one() {{ echo "half way"; printf '%s\\n' "Found existing installation: numpy" "Can't uninstall 'numpy'"
    read -r line <"$ROOT/go"; echo "$line"; }}
next_thing() {{ echo ", go on"; }}
choose_place one
make_ready one
"""


def test_a_step_that_takes_long_says_how_far_it_is(root, tmp_path):
    os.mkfifo(tmp_path / "go")
    command = ["bash", "-c", STEPS.format(tools=root / "tools")]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        told = [process.stderr.readline() for _ in range(5)]
        assert re.fullmatch(r"ws:     \d+ s: half way\n", told[3]), told
        (tmp_path / "go").write_text("through\n")
        told += process.stderr.readlines()  # up to its end: nothing is left that could write there
    assert process.returncode == 0
    assert told[1] == "ws: [1/1] the step: not much\n"
    assert re.fullmatch(r"ws: \[1/1\] the step: done in \d+ s\n", told[-2])
    assert re.fullmatch(r"ws: ready after \d+ s, go on\n", told[-1])
    assert (
        tmp_path / ".ws/log/one.log"
    ).read_text() == "half way\nFound existing installation: numpy\nCan't uninstall 'numpy'\nthrough\n"


@pytest.mark.slow
def test_what_others_build_against_comes_with_its_size(ws, checkout, debian):
    (checkout / "requirements/debian.txt").write_text("")
    (checkout / "requirements/foreign.txt").write_text("one\ntwo\n")
    told = ws("foreign", "true", script=checkout / "ws", **debian).stderr
    assert "Debian packages that others build against: 12 packages, 34.5 MB to fetch" in told
    assert "Debian packages that others build against: done in" in told
