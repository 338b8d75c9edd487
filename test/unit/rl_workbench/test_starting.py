"""Ctrl-C while modules are being read ends the process, whatever they do with exceptions."""

import signal
import subprocess
import sys

import pytest

PROGRAM = """
import signal, sys
from rl_workbench.starting import ended_by_ctrl_c

if "ignored" in sys.argv:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
with ended_by_ctrl_c():
    try:
        if "inside" in sys.argv:
            signal.raise_signal(signal.SIGINT)
    except BaseException:
        print("swallowed")
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    print("as ever")
"""


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["inside"], -signal.SIGINT, ""),
        ([], 0, "as ever\n"),
        (["inside", "ignored"], 0, ""),
    ],
    ids=["inside", "afterwards", "ignored"],
)
def test_ctrl_c(arguments: list[str], code: int, told: str) -> None:
    command = [sys.executable, "-c", PROGRAM, *arguments]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (code, told)


@pytest.mark.parametrize("script", ["workbench.py", "pg_train.py", "dqn_train.py", "lockstep.py"])
def test_the_commands_start_so(script: str, root) -> None:
    """All that may take long comes after it."""
    lines = (root / "scripts" / script).read_text().splitlines()
    assert [line for line in lines if "import " in line][:2] == [
        "import sys",
        "    from rl_workbench.starting import ended_by_ctrl_c",
    ]
