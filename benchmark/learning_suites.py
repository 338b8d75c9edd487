"""Runs suites of config/benchmark.yaml one after another, with the flags of `workbench.py benchmark`."""

import argparse
from pathlib import Path

from rl_workbench.cli import main


def run(*suites: str) -> int:
    """Each suite into a folder of its own below --out (runs/benchmark); the first failure's exit code."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--out", type=Path, default=Path("runs/benchmark"))
    chosen, flags = parser.parse_known_args()
    for suite in suites:
        code = main(["benchmark", suite, f"--out={chosen.out / suite}", *flags])
        if code:
            return code
    return 0
