"""Commands, and Python code, in processes of their own."""

import subprocess
import sys
from typing import Any

LIMIT = 300.0  # [s]


def run(
    command: Any, check: bool = False, timeout: float = LIMIT, **options: Any
) -> subprocess.CompletedProcess[str]:
    """What a command has written, to which nobody types; options are those of subprocess.run."""
    return subprocess.run(
        command, check=check, timeout=timeout, stdin=subprocess.DEVNULL, capture_output=True, text=True,
        **options,
    )  # fmt: skip


def run_python(
    code: str, *arguments: str, check: bool = True, **options: Any
) -> subprocess.CompletedProcess[str]:
    """What a process has written that ran the code; with `check` it has to succeed."""
    return run([sys.executable, "-c", code, *arguments], check=check, **options)


def loaded_by(modules: str) -> set[str]:
    """The top-level packages that a fresh Python has after importing modules."""
    done = run_python(f"import sys, {modules}; print(*sys.modules)")
    return {name.partition(".")[0] for name in done.stdout.split()}
