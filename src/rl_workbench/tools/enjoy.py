"""`enjoy`: plays greedy episodes in a window, or on a page in the browser."""

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
    parser.add_argument("--episodes", type=number(1), default=1, metavar="N", help="default 1")
    parser.add_argument("--gui", action="store_true",
                        help="show a page in the browser, even if the environment has a window; "
                        "each episode has its own seed, from --seed on")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Plays the episodes in a window or on a page."""
    from rl_workbench.tools.eval import episode_lines
    from rl_workbench.tools.policies import environment_of, load_learned, play
    from rl_workbench.tools.recording import draws_itself
    from rl_workbench.tools.run_page import show_run
    from rl_workbench.tools.runs import open_run
    from web_viewer.address import LOOPBACK

    run, options = open_run(arguments.run), env_options(arguments)
    on_page = arguments.gui
    if not on_page:
        with closing(environment_of(run, options)) as env:
            on_page = draws_itself(env)
    if on_page:
        show_run(run.folder, (arguments.checkpoint,), arguments.seed, arguments.episodes, options,
                 host=LOOPBACK, port=None, browser=True, interrupt=interrupt)  # fmt: skip
        return
    if not any(os.environ.get(name) for name in WINDOWS):
        raise WorkbenchError(
            "enjoy needs a display for its window, and DISPLAY isn't set; --gui shows a page in the "
            f"browser instead, record {arguments.run} --out episode.gif writes a file"
        )
    policy = load_learned(run, arguments.checkpoint, {**options, "render_mode": "human"})
    with closing(policy.env):
        tell(episode_lines(play(policy, arguments.episodes, arguments.seed)))
