"""gzserver's command line (docs/contract/gazebo_launch.md 4.2). What is inert is accepted."""

import argparse
from collections.abc import Sequence

EMPTY_WORLD = "empty.world"
INERT = {  # options that have no effect here, and how many values follow them
    ("-r", "--record"): 0,
    ("-q", "--quiet"): 0,
    ("--verbose",): 0,
    ("--minimal_comms",): 0,
    ("--record_resources",): 0,
    ("-s", "--server-plugin"): 1,
    ("-g", "--gui-plugin"): 1,
    ("-i", "--iters"): 1,
    ("-p", "--play"): 1,
    ("--record_path",): 1,
    ("--record_encoding",): 1,
    ("--record_period",): 1,
    ("--record_filter",): 1,
}


def parse_args(argv: Sequence[str]) -> argparse.Namespace:
    """Reads the options, in any order; arguments of the form a:=b are ROS's and may stand anywhere.

    Returns:
        world, paused, physics, lockstep, replace, seed, what begins with video, and `ignored`: what isn't
        known.
    """
    parser = argparse.ArgumentParser(
        prog="gzserver",
        description="A stand-in for Gazebo's server.",
        usage="gzserver [options] [WORLD_FILE]",
        allow_abbrev=False,
    )
    # The world is taken from what is left: it may stand anywhere, also behind an unknown option.
    parser.add_argument("-u", dest="paused", action="store_true", help="start paused")
    parser.add_argument(
        "-e", "--physics", default="ode", help="mujoco; all of Gazebo's own names mean PyBullet"
    )
    parser.add_argument("-o", "--profile", nargs="?", help="accepted, without effect")
    parser.add_argument("--lockstep", action="store_true", help="time moves only by ~step_world")
    parser.add_argument(
        "--replace", action="store_true", help="end a simulator that has this one's name already"
    )
    parser.add_argument(
        "--video", default="", help="an MP4 file that the simulation is recorded in"
    )
    parser.add_argument(
        "--video-rate", type=float, default=30.0, help="its pictures for a second of simulated time"
    )
    parser.add_argument(
        "--video-size", type=int, nargs=2, default=(640, 480), help="its width and height [pixels]"
    )
    parser.add_argument(
        "--video-model", default="", help="who is in its middle; else all that can move"
    )
    parser.add_argument("--seed", type=int, help="of Python's and NumPy's random numbers")
    for names, values in INERT.items():
        kind = {"nargs": values} if values else {"action": "store_const", "const": True}
        parser.add_argument(*names, help="accepted, without effect", **kind)
    args, left = parser.parse_known_args([argument for argument in argv if ":=" not in argument])
    worlds = [argument for argument in left if not argument.startswith("-")]
    if not worlds and args.profile and args.profile.endswith(".world"):
        worlds = [args.profile]  # -o is often given without a value
    args.world = worlds[-1] if worlds else EMPTY_WORLD
    args.ignored = [argument for argument in left if argument != args.world]
    return args
