"""eval, enjoy and record: a run's policy at work."""

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rl_workbench.env_ids import threshold
from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.storage import as_json, check_writable, write_file
from rl_workbench.tools.commands.shared import add_policy_flags, env_options, number
from rl_workbench.tools.commands.viewing import show as show_page
from rl_workbench.tools.pictures import videos
from rl_workbench.tools.pictures.filming import (
    DISPLAYS,
    Player,
    Recorded,
    SideBySide,
    Size,
    draw_without_display,
    film_episode,
    size_options,
)
from rl_workbench.tools.pictures.scenes import is_scene, record_scene
from rl_workbench.tools.runs import episodes
from rl_workbench.tools.runs.policies import (
    RANDOM,
    WHICH,
    LearnedPolicy,
    RandomPolicy,
    load_learned,
    random_policy,
)
from rl_workbench.tools.runs.runs import Run, open_run
from rl_workbench.tools.viewing.page import Place, Wanted
from rl_workbench.training.progress import tell
from viewer.address import LOOPBACK

WINDOWS = (*DISPLAYS, "SDL_VIDEODRIVER")  # where any of them is given, a window may be opened


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Flags of one of the three."""
    choices = WHICH if command == "enjoy" else (*WHICH, RANDOM)
    add_policy_flags(parser, choices, several=command == "record")
    add = parser.add_argument
    if command == "eval":
        add("--episodes", type=number(1), default=100, metavar="N", help="default 100")
        add("--json", type=Path, metavar="FILE", help="the figures; - for standard output")
        return
    if command == "enjoy":
        add("--episodes", type=number(1), default=1, metavar="N", help="default 1")
        add("--gui", action="store_true", help="on a page in the browser instead, as view does; "
            "each episode has a seed of its own, from --seed on")  # fmt: skip
        return
    add("--out", type=Path, required=True, metavar="FILE", help="ends in .gif, .mp4 or .html")
    add("--max-steps", type=number(0), default=0, metavar="N",
        help="cuts the episode off; 0: never (default)")  # fmt: skip
    add("--size", type=_size, metavar="WIDTHxHEIGHT",
        help="of an episode's pictures [pixels]; by default the environment's")  # fmt: skip
    add("--fps", type=_rate, metavar="HZ",
        help="frames per second of simulated time (default 25, of an MP4 50)")  # fmt: skip
    add("--no-captions", action="store_true", help="no line with step, return and action")


def _size(text: str) -> Size:
    words = text.lower().split("x")
    if len(words) != 2 or not all(word.isdecimal() and 16 <= int(word) <= 4096 for word in words):
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT, 16x16 to 4096x4096: {text}")
    return int(words[0]), int(words[1])


def _rate(text: str) -> float:
    value = float(text)
    if not 0.1 <= value <= 240.0:
        raise argparse.ArgumentTypeError(f"must lie between 0.1 and 240: {text}")
    return value


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """One of the three.

    Raises:
        WorkbenchError: if something is wrong with the run, the display or the file.
    """
    commands = {"eval": _eval, "enjoy": _enjoy, "record": _record}
    run = open_run(arguments.run)
    if arguments.command == "enjoy" and arguments.gui:
        _enjoy_on_page(arguments, run, interrupt)
    else:
        commands[arguments.command](arguments, run)


def _policy(
    arguments: argparse.Namespace, run: Run, which: str | None = None, **options: Any
) -> LearnedPolicy | RandomPolicy:
    chosen, given = which or arguments.checkpoint, {**env_options(arguments), **options}
    if chosen == RANDOM:
        return random_policy(run, given, arguments.seed)
    return load_learned(run, chosen, given)


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
    checkpoint = str(policy.checkpoint) if isinstance(policy, LearnedPolicy) else RANDOM
    found = {"run": str(run.folder), **episodes.statistics(result, checkpoint, line)}
    # With the figures on standard output, what people read goes beside it.
    stream = sys.stderr if to_stdout else sys.stdout
    tell(episodes.lines(result), stream)
    tell(episodes.summary(found, line), stream)
    if to_stdout:
        tell(json.dumps(found, indent=1))
    elif arguments.json:
        write_file(arguments.json, as_json(found))


def _enjoy(arguments: argparse.Namespace, run: Run) -> None:
    if not any(os.environ.get(name) for name in WINDOWS):
        raise WorkbenchError(
            "enjoy needs a display to open a window on, and DISPLAY isn't set; "
            f"--gui shows it on a page in the browser, record {arguments.run} --out episode.gif writes it"
        )
    policy = _policy(arguments, run, render_mode="human")
    try:
        tell(episodes.lines(episodes.play(policy, arguments.episodes, arguments.seed)))
    finally:
        policy.env.close()


def _enjoy_on_page(arguments: argparse.Namespace, run: Run, interrupt: Interrupt) -> None:
    show_page(
        Wanted(
            run.folder,
            (arguments.checkpoint,),
            arguments.seed,
            arguments.episodes,
            env_options(arguments),
        ),
        Place(LOOPBACK, None, browser=True),
        interrupt,
    )


def _record(arguments: argparse.Namespace, run: Run) -> None:
    out = arguments.out
    videos.check_format(out)
    fastest = arguments.fps or videos.default_rate(out)
    if out.suffix.lower() == ".gif" and fastest > videos.FASTEST:
        raise WorkbenchError(f"--fps: a GIF has {videos.FASTEST:g} frames a second at most")
    check_writable(out)
    draw_without_display()
    with contextlib.ExitStack() as stack:
        players = []
        for which in arguments.checkpoint:
            players.append(_player(arguments, run, which))
            stack.callback(players[-1].env.close)
        as_scene = out.suffix.lower() == ".html" and is_scene(players[0].env)
        write = _write_scene if as_scene else _write_film
        ends, frames, seconds = write(arguments, players, fastest)
    for player, end in zip(players, ends, strict=True):
        told = f"{player.title}: " if player.title else ""
        words = {None: "", True: ", success", False: ", no success"}[end.success]
        tell(f"{told}return {end.total_reward:.2f} in {end.length} steps{words}")
    tell(f"{out}: {frames} frames, {seconds:.1f} s")


def _player(arguments: argparse.Namespace, run: Run, which: str) -> Player:
    sized = size_options(run.env_id, arguments.size)
    try:
        return _player_of(arguments, run, which, sized)
    except WorkbenchError:
        if not sized:
            raise
    return _player_of(arguments, run, which, {})  # pictures of its own size can be scaled


def _player_of(
    arguments: argparse.Namespace, run: Run, which: str, sized: dict[str, int]
) -> Player:
    options = {"render_mode": "rgb_array", **sized}
    title = which if len(arguments.checkpoint) > 1 else ""
    policy = _policy(arguments, run, which, **options)
    return Player(title, policy.env, policy.act)


def _write_film(
    arguments: argparse.Namespace, players: Sequence[Player], fastest: float
) -> Recorded:
    films = [
        film_episode(
            player,
            episodes.TEST_SEED + arguments.seed,
            fastest,
            longest=arguments.max_steps,
            size=arguments.size,
            captions=not arguments.no_captions,
        )  # fmt: skip
        for player in players
    ]
    frames = SideBySide(films)
    videos.write_video(arguments.out, frames, films[0].rate)
    return Recorded([film.end for film in films], len(frames), len(frames) / films[0].rate)


def _write_scene(
    arguments: argparse.Namespace, players: Sequence[Player], fastest: float
) -> Recorded:
    if arguments.size:
        raise WorkbenchError("--size: a recording in 3-D is as large as the browser's window")
    return record_scene(
        arguments.out, players, episodes.TEST_SEED + arguments.seed, fastest,
        longest=arguments.max_steps, captions=not arguments.no_captions,
    )  # fmt: skip
