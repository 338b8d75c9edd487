"""`enjoy`: plays greedy episodes in the environment's own window."""

import argparse
import os
from contextlib import closing

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import add_policy_flags, env_options, number
from rl_workbench.training.progress import tell

# Without any of these, no window can be opened.
WINDOWS = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add_policy_flags(parser)
    parser.add_argument(
        "--episodes",
        type=number(1),
        default=1,
        metavar="N",
        help="of a window (default 1); a page has a field for the seed",
    )


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Plays the episodes; robots have a page in the browser, as `view` shows."""
    from rl_workbench.tools.eval import episode_lines
    from rl_workbench.tools.policies import environment_of, load_learned, play
    from rl_workbench.tools.recording import draws_itself
    from rl_workbench.tools.run_page import show_run
    from rl_workbench.tools.runs import open_run

    run, options = open_run(arguments.run), env_options(arguments)
    with closing(environment_of(run, options)) as env:
        has_page = draws_itself(env)
    if has_page:
        show_run(run.folder, (arguments.checkpoint,), arguments.seed, options, interrupt=interrupt)
        return
    if not any(os.environ.get(name) for name in WINDOWS):
        raise WorkbenchError(
            f"enjoy needs a display for its window, and DISPLAY isn't set; view {arguments.run} shows a page "
            f"in the browser instead, record {arguments.run} --out episode.gif writes a file"
        )
    policy = load_learned(run, arguments.checkpoint, {**options, "render_mode": "human"})
    with closing(policy.env):
        tell(episode_lines(play(policy, arguments.episodes, arguments.seed)))
