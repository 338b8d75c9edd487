"""What one training run can be told: flags, and the same as rosparams."""

import argparse
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from cartpole.errors import CartpoleError
from cartpole.task import MAX_STEPS

COMMAND = "pg_train.py"
DESCRIPTION = """\
Trains the cart-pole by policy gradient over ROS, in lock-step with the simulator.

Starts what isn't running (master, simulator, robot, controllers) and stops exactly that.
Every flag is a private rosparam too (~episodes, ~seed, ~run_dir, ~save_every, ~realtime,
~gui, ~random_weights, ~start_noise, ~algorithm, ~backend, ~stop_at); the command line wins.
Ctrl-C saves what was learned and exits with 130 (SIGTERM: 143).
Exit codes: 0 done, 1 failed (what was learned is saved), 2 wrong arguments."""

LARGEST_NOISE = 0.2  # [m], [rad]; just inside the angle at which an episode ends
SWITCHES = ("realtime", "gui", "random_weights")


@dataclass(frozen=True)
class Settings:
    """What a user can choose for one training."""

    episodes: int = 600
    seed: int = 0
    run_dir: str | None = None
    save_every: int = 100
    realtime: bool = False
    gui: bool = False
    random_weights: bool = False
    start_noise: float = 0.0
    algorithm: str = "document"
    backend: str = "ros"
    stop_at: float = 0.0


def parser() -> argparse.ArgumentParser:
    """The flags, with their defaults."""
    result = argparse.ArgumentParser(
        COMMAND,
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add, default = result.add_argument, Settings()
    add("--episodes", type=_at_least(1), default=default.episodes, metavar="N", help="default 600")
    add(
        "--seed",
        type=_at_least(0),
        default=default.seed,
        metavar="N",
        help="of weights, actions, evaluation and simulator (default 0)",
    )
    add(
        "--run-dir",
        metavar="DIR",
        help="a new or empty folder for all results (default runs/cartpole__pg__SEED__TIME)",
    )
    add(
        "--save-every",
        type=_at_least(0),
        default=default.save_every,
        metavar="N",
        help="episodes between saves of the networks; 0: at the end only (default 100)",
    )
    add(
        "--realtime",
        action="store_true",
        help="let the world run by itself, as the existing script does",
    )
    add(
        "--random-weights",
        action="store_true",
        help="draw all initial weights at random, as the existing script does; by default the "
        "output layers start at zero, which learns more reliably",
    )
    add(
        "--start-noise",
        type=_noise,
        default=default.start_noise,
        metavar="X",
        help="episodes start within +-X of the origin [m] and of upright [rad]; 0, as the existing "
        "script does, starts them all alike (default %(default)s)",
    )
    add(
        "--algorithm",
        choices=("document", "gae"),
        default=default.algorithm,
        help="document: the existing script's; gae: REINFORCE with a fitted baseline and generalised "
        "advantages, which learns in a third of the episodes (default %(default)s)",
    )
    add(
        "--backend",
        choices=("ros", "bullet"),
        default=default.backend,
        help="the robot in a simulator over ROS, or in this process: the same bits, several times as "
        "fast, and no ROS needed (default %(default)s)",
    )
    add(
        "--stop-at",
        type=_length,
        default=default.stop_at,
        metavar="X",
        help="end when the last 20 episodes lasted X steps on average; 0: after all episodes "
        "(default 0)",
    )
    window = result.add_mutually_exclusive_group()
    window.add_argument("--gui", action="store_true", help="show the simulator's window")
    window.add_argument(
        "--headless", dest="gui", action="store_false", help="no window (the default)"
    )
    return result


def _at_least(minimum: int) -> Any:
    def number(text: str) -> int:
        value = int(text)
        if not minimum <= value < 2**31:
            raise argparse.ArgumentTypeError(f"must be at least {minimum} and below 2^31: {text}")
        return value

    return number


def _noise(text: str) -> float:
    value = float(text)
    if not 0.0 <= value <= LARGEST_NOISE:
        raise argparse.ArgumentTypeError(f"must lie between 0 and {LARGEST_NOISE}: {text}")
    return value


def _length(text: str) -> float:
    value = float(text)
    if not 0.0 <= value <= MAX_STEPS:
        raise argparse.ArgumentTypeError(f"must lie between 0 and {MAX_STEPS}: {text}")
    return value


def as_flags(parameters: dict[str, Any]) -> list[str]:
    """Private rosparams as flags, so that both go through the same checks.

    Raises:
        CartpoleError: if there is no such parameter, or a switch isn't true or false.
    """
    known = list(Settings.__dataclass_fields__)
    flags: list[str] = []
    for name, value in parameters.items():
        if name not in known:
            near = get_close_matches(name, known, 1) or known
            raise CartpoleError(f"unknown parameter ~{name}; did you mean ~{', ~'.join(near)}?")
        flags += _flag(name, value)
    return flags


def _flag(name: str, value: Any) -> list[str]:
    flag = f"--{name.replace('_', '-')}"
    if name in SWITCHES:
        if not isinstance(value, bool):
            raise CartpoleError(f"parameter ~{name} must be true or false, not {value!r}")
        return [flag] if value else []
    return [] if value == "" else [f"{flag}={value}"]


def settings(flags: list[str], parameters: dict[str, Any]) -> Settings:
    """Defaults, overridden by rosparams, overridden by flags.

    Raises:
        SystemExit: with code 2 and a usage line, if a flag is wrong; with 0 after --help.
        CartpoleError: if a rosparam is unknown.
    """
    known = parser()
    from_parameters = known.parse_args(as_flags(parameters))
    chosen = Settings(**vars(known.parse_args(flags, namespace=from_parameters)))
    fault = _contradiction(chosen)
    if fault:
        known.error(fault)
    return chosen


def _contradiction(chosen: Settings) -> str:
    """What can't be had together; empty if nothing."""
    if chosen.backend == "bullet" and (chosen.realtime or chosen.gui):
        return "--realtime and --gui are of a simulator over ROS: not with --backend bullet"
    if chosen.algorithm == "gae" and chosen.random_weights:
        return "--random-weights is the document's start: not with --algorithm gae"
    return ""
