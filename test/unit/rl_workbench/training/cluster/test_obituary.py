"""What is said of a process that ends without a word, and what ends with it."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import os, signal, sys
from pathlib import Path
from rl_workbench.training.cluster.obituary import obituary
log = Path(sys.argv[1], "own.log").open("w")
with obituary("It is gone.", Path(sys.argv[1])):
    if sys.argv[2] == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize(("end", "line"), [("killed", "It is gone.\n"), ("orderly", "")])
def test_who_writes_in_the_folder_ends_with_it(tmp_path: Path, end: str, line: str) -> None:
    """As Ray's agents do; who only reads there stays."""
    log = tmp_path / "session" / "agent.log"
    log.parent.mkdir()
    with log.open("w") as output:
        writer = subprocess.Popen(["cat"], stdin=subprocess.PIPE, stdout=output)
    with log.open() as seen:
        reader = subprocess.Popen(["cat", "-", str(log)], stdin=subprocess.PIPE, stderr=seen)
    try:
        command = [sys.executable, "-c", SCRIPT, str(tmp_path), end]
        # Until who says it has ended, too: the stream is that one's as well.
        ended = subprocess.run(command, check=False, stderr=subprocess.PIPE, text=True)
        assert (ended.stderr, ended.returncode) == (line, -9 if line else 0)
        assert writer.wait() == -9 and reader.poll() is None
    finally:
        for each in (writer, reader):
            each.kill()
            each.communicate()
