"""What one policy-gradient training can be told: flags, rosparams, a YAML section and KEY=VALUE."""

import argparse
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

from cartpole.tasks import MAX_STEPS
from rl_workbench.agents.pg.settings import ReinforceSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import check_options, option
from rl_workbench.training.options.command_options import CommandOptions, flag
from rl_workbench.training.options.config_file import default_file, read_section
from rl_workbench.training.options.options import Options
from rl_workbench.training.run.record import CONFIG_RECORD, is_plain, read_record

COMMAND = "pg_train.py"
CONFIG = "pg.yaml"
ALGORITHM = "pg"  # in config.json
ROBOT = "cartpole/Balance-v0"
DESCRIPTION = """\
Trains by policy gradient: the cart-pole robot over ROS, in lock-step with the simulator, or any
Gymnasium environment with single actions in this process.

Starts what isn't running (master, simulator, robot, controllers) and stops exactly that.
What isn't given comes from config/pg.yaml, the environment's section; options of the algorithm
count with --algorithm gae only. Every flag is a private rosparam too (~episodes, ~seed, ...). The
command line wins over rosparams, these over --params, and all of them over the file.
Ctrl-C saves everything and exits with 130 (SIGTERM: 143); --resume goes on from there, to the
same bits as a training that was never interrupted.
Exit codes: 0 done, 1 failed (what was learned is saved), 2 wrong arguments."""

LARGEST_NOISE = 0.2  # [m], [rad]; just inside the angle at which an episode ends
ROBOTS_OWN = ("realtime", "gui", "random_weights", "start_noise")
# What differs from the defaults, which are the robot's, in any other environment.
ELSEWHERE = {"backend": "bullet", "algorithm": "gae", "normalize_observations": True}
EXTENDING = ("episodes", "stop_at")  # may be changed when resuming


@dataclass(frozen=True)
class Settings:
    """One training around the algorithm: where, how long, and what it leaves behind.

    Raises:
        WorkbenchError: if a value is beyond its limits, or two don't go together.
    """

    episodes: int = option(600, "the training's length", 1, 2**31 - 1)
    seed: int = option(0, "of weights, actions, evaluation and simulator", 0, 2**31 - 1)
    run_dir: str = option("", "a new or empty folder for all results (runs/ENV__EXP__SEED__TIME)")
    save_every: int = option(
        100, "episodes between saves of the networks as .pth; 0: at the end only", 0, 2**31 - 1
    )
    realtime: bool = option(False, "let the world run by itself, as the existing script does")
    gui: bool = option(False, "show the simulator's window")
    random_weights: bool = option(
        False, "draw all initial weights at random, as the existing script does; else the output "
        "layers start at zero, which learns more reliably",
    )  # fmt: skip
    start_noise: float = option(
        0.0, "episodes start within +-X of the origin [m] and of upright [rad]; 0, as the existing "
        "script does, starts them all alike", 0, LARGEST_NOISE,
    )  # fmt: skip
    algorithm: str = option(
        "document", "document: the existing script's; gae: REINFORCE with a fitted baseline and "
        "generalised advantages, which learns in a third of the episodes",
        choices=("document", "gae"),
    )  # fmt: skip
    backend: str = option(
        "ros", "ros: the robot in a simulator over ROS; bullet: in this process, with the same "
        "bits, several times as fast, and no ROS needed",
        choices=("ros", "bullet"),
    )  # fmt: skip
    stop_at: float = option(
        0.0, "end when the last 20 episodes lasted X steps on average; 0: after all", 0, 1e9
    )
    env_id: str = option(ROBOT, "Gymnasium's id of the environment; this one is the robot")
    env_kwargs: dict[str, Any] = option({}, "of another environment, KEY=VALUE with commas")
    exp_name: str = option("pg", "in the run folder's name; of gae it is gae")
    eval_frequency: int = option(
        0, "episodes between two evaluations; 0: at the end only", 0, 2**31 - 1
    )
    eval_episodes: int = option(20, "greedy episodes of an evaluation", 1, 10**6)
    confirm_episodes: int = option(
        0, "greedy episodes that a policy needs to become the best one; 0: those of the evaluation",
        0, 10**6,
    )  # fmt: skip
    checkpoint_frequency: int = option(
        20, "episodes between two checkpoints; 0: at the end only", 0, 2**31 - 1
    )
    keep_checkpoints: int = option(3, "the newest ones are kept; 0: all", 0, 10**6)

    def __post_init__(self) -> None:
        check_options(self)
        fault = _contradiction(self)
        if fault:
            raise WorkbenchError(fault)

    @property
    def is_robot(self) -> bool:
        """Whether it is the robot's own task, over ROS or not."""
        return self.env_id == ROBOT

    @property
    def over_ros(self) -> bool:
        """Whether a simulator is needed."""
        return self.is_robot and self.backend == "ros"


def _contradiction(chosen: Settings) -> str:
    """What can't be had together; empty if nothing."""
    if not chosen.env_id:
        return "env_id names an environment"
    if not is_plain(chosen.env_kwargs):
        return f"env_kwargs has values that no file can hold: {chosen.env_kwargs}"
    if not chosen.is_robot:
        return _foreign(chosen)
    if chosen.env_kwargs:
        return f"--env-kwargs are for other environments than the robot's, {ROBOT}"
    if chosen.backend == "bullet" and (chosen.realtime or chosen.gui):
        return "--realtime and --gui are of a simulator over ROS: not with --backend bullet"
    if chosen.algorithm == "gae" and chosen.random_weights:
        return "--random-weights is the document's start: not with --algorithm gae"
    if chosen.stop_at > MAX_STEPS:
        return f"stop_at: an episode of the robot has no more than {MAX_STEPS} steps"
    return ""


def _foreign(chosen: Settings) -> str:
    if chosen.algorithm == "document":
        return (
            f"the document's algorithm is made for the robot: {chosen.env_id} needs --algorithm gae"
        )
    for name in ROBOTS_OWN:
        if getattr(chosen, name):
            return f"{flag(name)} is of the robot, {ROBOT}: not with --env-id {chosen.env_id}"
    if chosen.backend == "ros":
        text = f"--backend ros is of the robot, {ROBOT}: {chosen.env_id} is made in this process"
        own = chosen.env_id.startswith("cartpole/")
        return f"{text}; --env-kwargs backend=ros has it over ROS" if own else text
    return ""


class Choice(NamedTuple):
    """What the user wants: a new training by these settings, or an old one resumed."""

    run: Settings
    gae: ReinforceSettings
    resume: Path | None


OPTIONS = Options(Settings, ReinforceSettings)
_ALGORITHMS_OWN = [each.name for each in fields(ReinforceSettings)]


def command_options() -> CommandOptions:
    """All flags; none has a default of its own."""
    result = argparse.ArgumentParser(
        COMMAND,
        usage=f"{COMMAND} [--help] [--OPTION VALUE ...]",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    result.add_argument(
        "--headless", action="store_true", default=argparse.SUPPRESS, help="no window (default)"
    )
    return CommandOptions(result, OPTIONS, CONFIG)


def choose(flags: list[str], parameters: dict[str, Any]) -> Choice:
    """Defaults, overridden by the file, --params, rosparams and flags, in this order.

    Raises:
        SystemExit: with code 2 and a usage line, if a flag is wrong, or options don't go
            together; with 0 after --help.
        WorkbenchError: if a name is unknown or a value wrong anywhere else.
    """
    known = command_options()
    given, special = known.given(flags, parameters)
    if given.pop("headless", False):
        if "--gui" in flags:
            known.parser.error("--headless: not with --gui")
        given["gui"] = False
    if "resume" in special:
        return _resumed(Path(special["resume"]), given, special)
    section = _section(given.get("env_id"), special.get("config"))
    try:
        return _new(given, section)
    except WorkbenchError as error:
        known.parser.error(str(error))


def _section(env_id: str | None, config: str | None) -> dict[str, Any]:
    path = Path(config) if config else default_file(CONFIG)
    return OPTIONS.read(read_section(path, env_id or ROBOT, None), config or f"config/{CONFIG}")


def _new(given: dict[str, Any], section: dict[str, Any]) -> Choice:
    merged = {**section, **given}
    if merged.get("env_id", ROBOT) != ROBOT:
        merged = {**ELSEWHERE, **merged}
    if merged.get("algorithm", "document") == "document":
        surplus = [name for name in given if name in _ALGORITHMS_OWN]
        if surplus:
            raise WorkbenchError(f"{flag(surplus[0])} is an option of --algorithm gae")
        merged = {name: merged[name] for name in merged if name not in _ALGORITHMS_OWN}
    else:
        merged.setdefault("exp_name", "gae")
    return _made(merged, None)


def _made(values: dict[str, Any], resume: Path | None) -> Choice:
    run, gae = OPTIONS.make(Settings, values), OPTIONS.make(ReinforceSettings, values)
    return Choice(run, gae, resume)


def _resumed(folder: Path, given: dict[str, Any], special: dict[str, str]) -> Choice:
    others = [name for name in given if name not in EXTENDING]
    others += [name for name in special if name != "resume"]
    if others:
        raise WorkbenchError(
            f"a resumed training keeps its settings: --resume allows no {flag(others[0])}, "
            f"only {', '.join(flag(name) for name in EXTENDING)}"
        )
    old = from_config(read_record(folder), str(folder / CONFIG_RECORD))
    return _made({**asdict(old.run), **asdict(old.gae), **given}, folder)


def config(choice: Choice, hyperparameters: dict[str, Any]) -> dict[str, Any]:
    """All as plain values, for config.json and checkpoints.

    Args:
        hyperparameters: of the algorithm that is chosen.
    """
    return {"algorithm": ALGORITHM, "run": asdict(choice.run), ALGORITHM: hyperparameters}


def from_config(content: Any, origin: str) -> Choice:
    """What `config` gave, also after JSON.

    Raises:
        WorkbenchError: if it is something else.
    """
    record = content if isinstance(content, dict) else {}
    run, own = record.get("run"), record.get(ALGORITHM)
    if record.get("algorithm") != ALGORITHM or not (
        isinstance(run, dict) and isinstance(own, dict)
    ):
        raise WorkbenchError(f"{origin} isn't the configuration of a policy-gradient training")
    return _made(OPTIONS.read({**run, **own}, origin), None)


def check_same(choice: Choice, content: Any, origin: str) -> None:
    """Holds the settings to resume with against those in a checkpoint.

    Raises:
        WorkbenchError: if one differs that a resumed training can't change, or these are no settings.
    """
    before, after = (
        asdict(each.run) | asdict(each.gae) for each in (from_config(content, origin), choice)
    )
    for name, value in before.items():
        if name not in EXTENDING and after[name] != value:
            raise WorkbenchError(
                f"{origin}: {CONFIG_RECORD} says {name} {after[name]}, the checkpoint {value}; a "
                "resumed training keeps its settings"
            )
