"""plot and policy: pictures of runs."""

import argparse
from pathlib import Path

from rl_workbench.plotting.curves import STEPS, training_curves
from rl_workbench.starting import Interrupt
from rl_workbench.storage import check_writable
from rl_workbench.tools.commands.shared import add_policy_flags, env_options, write_figure
from rl_workbench.tools.pictures.panels import run_panels
from rl_workbench.tools.pictures.policy_map import policy_map, state_plane
from rl_workbench.tools.runs.episodes import TEST_SEED
from rl_workbench.tools.runs.policies import load_learned
from rl_workbench.tools.runs.runs import find_runs, open_run
from rl_workbench.training.progress import tell, warn


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Flags of one of the two."""
    if command == "policy":
        add_policy_flags(parser)
    else:
        parser.add_argument("runs", nargs="+", metavar="RUN", help="run folders, or patterns")
        parser.add_argument("--over", choices=("episodes", "steps"), default="episodes",
                            help="the horizontal axis (default episodes)")  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.png", help="the picture")


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """One of the two.

    Raises:
        WorkbenchError: if something is wrong with a run or the file.
    """
    if arguments.command == "plot":
        panels = run_panels(find_runs(arguments.runs, warn), arguments.over)
        across = "episode" if arguments.over == "episodes" else STEPS
        write_figure(arguments.out, training_curves(panels, across))
    else:
        _policy(arguments)
    tell(str(arguments.out))


def _policy(arguments: argparse.Namespace) -> None:
    run = open_run(arguments.run)
    plane = state_plane(run.env_id)  # other environments are refused before anything is loaded
    check_writable(arguments.out)
    policy = load_learned(run, arguments.checkpoint, env_options(arguments))
    title = f"policy of {run.label}; cart in the middle, at rest"
    try:
        figure = policy_map(plane, policy, TEST_SEED + arguments.seed, title)
    finally:
        policy.env.close()
    write_figure(arguments.out, figure)
