"""export: a run's policy as a file that torch runs alone."""

import argparse
from pathlib import Path

from rl_workbench.starting import Interrupt
from rl_workbench.storage import check_writable, write_file
from rl_workbench.tools.commands.shared import add_policy_flags, env_options
from rl_workbench.tools.runs.exported import open_exported
from rl_workbench.tools.runs.exporting import Agreement, export
from rl_workbench.tools.runs.policies import load_learned
from rl_workbench.tools.runs.runs import open_run
from rl_workbench.training.progress import tell


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Flags of the subcommand."""
    add_policy_flags(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.pt",
                        help="TorchScript: observations (N, ...) to greedy actions (N, ...)")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Exports.

    Raises:
        WorkbenchError: if something is wrong with the run or the file, or the file would act otherwise.
    """
    run = open_run(arguments.run)
    check_writable(arguments.out)
    policy = load_learned(run, arguments.checkpoint, env_options(arguments))
    try:
        content, agreement = export(run, policy, arguments.seed)
    finally:
        policy.env.close()
    write_file(arguments.out, lambda stream: stream.write(content))
    open_exported(arguments.out)  # what lies on the disk now
    tell(
        f"{arguments.out}: the policy of {policy.checkpoint}, {policy.steps} steps; the same action in "
        f"{agreement.equal} of {agreement.observations} observations{_rest(agreement)}"
    )


def _rest(agreement: Agreement) -> str:
    """How far the others are."""
    if agreement.equal == agreement.observations:
        return ""
    if not agreement.largest_difference:
        return ", as good as tied in the others"
    return f", within {agreement.largest_difference:.1g} of the bounds' distance in the others"
