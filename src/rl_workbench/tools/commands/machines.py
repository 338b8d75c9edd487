"""Where a command's jobs run: flags, and the machines that they name."""

import argparse
import contextlib
from collections.abc import Iterator
from pathlib import Path

from rl_workbench.option import Options
from rl_workbench.starting import Interrupt
from rl_workbench.tools.commands.shared import number
from rl_workbench.tools.jobs.ledger import settle
from rl_workbench.tools.jobs.machines import CARRIED, SHARED, Machines, ThisMachine
from rl_workbench.training.options import ClusterOptions
from rl_workbench.training.progress import tell


def add_job_flags(parser: argparse.ArgumentParser) -> None:
    """Where jobs run, and how many at a time."""
    parser.add_argument("--jobs", type=number(1), metavar="N",
        help="trainings at a time, each on one core (1; with --ray as many as there are cores)")  # fmt: skip
    Options(ClusterOptions).add_flags(parser)
    parser.set_defaults(ray=None)
    parser.add_argument("--folders", choices=(SHARED, CARRIED),
        help="with --ray: seen by all nodes, or carried home by Ray (found out)")  # fmt: skip


@contextlib.contextmanager
def machines_for(
    arguments: argparse.Namespace, folder: Path, interrupt: Interrupt
) -> Iterator[Machines]:
    """Where the jobs of a command run: here, or on the cluster that it names.

    Args:
        arguments: with the flags of `add_job_flags`, and the program.
        folder: in which all jobs' folders lie.

    Raises:
        WorkbenchError: if there is no such cluster.
    """
    settle(folder)
    if arguments.ray is None:
        yield ThisMachine(arguments.jobs or 1, arguments.program)
        return
    with contextlib.ExitStack() as stack:
        with interrupt.reading():  # Ray's processes are started, or none of them
            from rl_workbench.tools.jobs.cluster.nodes import RayNodes
            from rl_workbench.training.cluster.joining import joined

            cluster = stack.enter_context(joined(arguments.ray, "the same command goes on"))
        nodes = RayNodes(cluster, folder, arguments.program, arguments.jobs, arguments.folders)
        tell(nodes.about())
        yield nodes
