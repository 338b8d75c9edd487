"""`export`: a run's policy as a file that needs only torch."""

import argparse
from contextlib import closing
from pathlib import Path

from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import add_policy_flags, env_options
from rl_workbench.training.progress import tell


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add_policy_flags(parser, plays=False)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.pt",
                        help="TorchScript: observations (N, ...) to greedy actions (N, ...)")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Exports the policy."""
    from rl_workbench.storage import check_writable, write_file
    from rl_workbench.tools.policies import load_learned
    from rl_workbench.tools.runs import open_run
    from rl_workbench.tools.torchscript import export

    run = open_run(arguments.run)
    check_writable(arguments.out)
    policy = load_learned(run, arguments.checkpoint, env_options(arguments))
    with closing(policy.env):
        content = export(run, policy)
    write_file(arguments.out, lambda stream: stream.write(content))
    tell(f"{arguments.out}: the policy of {policy.checkpoint}, {policy.steps} steps")
