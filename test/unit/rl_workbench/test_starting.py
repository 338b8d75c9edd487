"""Ctrl-C while modules are being read ends the process, whatever they do with exceptions."""

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
    [(["inside"], 130, "-c: interrupted\n"), ([], 0, "as ever\n"), (["inside", "ignored"], 0, "")],
    ids=["inside", "afterwards", "ignored"],
)
def test_ctrl_c(arguments: list[str], code: int, told: str) -> None:
    command = [sys.executable, "-c", PROGRAM, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout + done.stderr) == (code, told)


def test_the_commands_start_so(root) -> None:
    """All that may take long comes after it."""
    for script in (root / "scripts").iterdir():
        lines = [line for line in script.read_text().splitlines() if "import " in line]
        ours = [line for line in lines if line[7:] not in ("argparse", "os", "sys")]
        assert ours[0].startswith("    from rl_workbench.starting import ended_by_ctrl_c"), script
