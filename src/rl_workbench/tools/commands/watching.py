"""eval, enjoy and record: a run's policy at work."""

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.commands.shared import add_policy_flags, env_options, number
from rl_workbench.tools.pictures import videos
from rl_workbench.tools.runs import episodes
from rl_workbench.tools.runs.policies import LearnedPolicy, load_learned
from rl_workbench.tools.runs.runs import Run, open_run, threshold
from rl_workbench.training.run.files import as_json, check_writable, write_file
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.progress import tell

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")  # any of them names one


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Flags of one of the three."""
    add_policy_flags(parser)
    add = parser.add_argument
    if command == "eval":
        add("--episodes", type=number(1), default=100, metavar="N", help="default 100")
        add("--json", type=Path, metavar="FILE", help="the figures; - for standard output")
        return
    if command == "enjoy":
        add("--episodes", type=number(1), default=1, metavar="N", help="default 1")
        return
    add("--out", type=Path, required=True, metavar="FILE", help="ends in .gif or .mp4")
    add("--max-steps", type=number(0), default=0, metavar="N",
        help="cuts the episode off; 0: never (default)")  # fmt: skip
    add("--scale", type=_scale, default=1.0, metavar="X",
        help="of width and height (default 1)")  # fmt: skip


def _scale(text: str) -> float:
    value = float(text)
    if not 0.05 <= value <= 4.0:
        raise argparse.ArgumentTypeError(f"must lie between 0.05 and 4: {text}")
    return value


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """One of the three.

    Raises:
        WorkbenchError: if something is wrong with the run, the display or the file.
    """
    commands = {"eval": _eval, "enjoy": _enjoy, "record": _record}
    commands[arguments.command](arguments, open_run(arguments.run))


def _policy(arguments: argparse.Namespace, run: Run, **options: Any) -> LearnedPolicy:
    return load_learned(run, arguments.checkpoint, {**env_options(arguments), **options})


def _eval(arguments: argparse.Namespace, run: Run) -> None:
    to_stdout = str(arguments.json) == "-"
    if arguments.json and not to_stdout:
        check_writable(arguments.json)
    policy = _policy(arguments, run)
    try:
        result = episodes.play(policy, arguments.episodes, arguments.seed)
    finally:
        policy.env.close()
    line = threshold(run.env_id)
    found = {"run": str(run.folder), **episodes.statistics(result, policy.checkpoint, line)}
    # With the figures on standard output, what people read goes beside it.
    stream = sys.stderr if to_stdout else sys.stdout
    tell(episodes.lines(result), stream)
    tell(episodes.summary(found, line), stream)
    if to_stdout:
        tell(json.dumps(found, indent=1))
    elif arguments.json:
        write_file(arguments.json, as_json(found))


def _enjoy(arguments: argparse.Namespace, run: Run) -> None:
    if not any(os.environ.get(name) for name in DISPLAYS):
        raise WorkbenchError(
            "enjoy needs a display to open a window on, and DISPLAY isn't set; "
            f"record {arguments.run} --out episode.gif shows it without one"
        )
    policy = _policy(arguments, run, render_mode="human")
    try:
        tell(episodes.lines(episodes.play(policy, arguments.episodes, arguments.seed)))
    finally:
        policy.env.close()


def _record(arguments: argparse.Namespace, run: Run) -> None:
    videos.check_format(arguments.out)
    check_writable(arguments.out)
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # or pygame would look for a screen
    policy = _policy(arguments, run, render_mode="rgb_array")
    fastest = videos.GIF_RATE if arguments.out.suffix.lower() == ".gif" else videos.MP4_RATE
    try:
        video = videos.record_episode(
            policy, episodes.TEST_SEED + arguments.seed, fastest, arguments.max_steps
        )
    finally:
        policy.env.close()
    videos.write_video(arguments.out, video, arguments.scale)
    tell(
        f"{arguments.out}: return {video.total_reward:.2f} in {video.length} steps, "
        f"{len(video.frames)} frames, {len(video.frames) / video.rate:.1f} s"
    )
