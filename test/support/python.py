"""Python code in a process of its own."""

import subprocess
import sys
from typing import Any


def run_python(
    code: str, *arguments: str, check: bool = True, **options: Any
) -> subprocess.CompletedProcess[str]:
    """What a process has written that ran the code; with `check` it has to succeed."""
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=check, **options)
