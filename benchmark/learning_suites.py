"""Runs suites of config/benchmark.yaml one after another, with the flags of `workbench.py benchmark`."""

import sys

from cartpole.workbench.cli import main


def run(*suites: str) -> int:
    """Each suite into a folder of its own below runs/benchmark/; the first failure's exit code."""
    for suite in suites:
        code = main(["benchmark", suite, *sys.argv[1:]])
        if code:
            return code
    return 0
