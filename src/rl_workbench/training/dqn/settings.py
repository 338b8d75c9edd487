"""What one DQN training can be told: flags, rosparams, a YAML section and KEY=VALUE."""

import argparse
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

from rl_workbench.agents.dqn.settings import DQNSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import check_options, option
from rl_workbench.training.options.command_options import CommandOptions, flag
from rl_workbench.training.options.config_file import default_file, read_section
from rl_workbench.training.options.options import Options
from rl_workbench.training.run.record import CONFIG_RECORD, is_plain, read_record

COMMAND = "dqn_train.py"
CONFIG = "dqn.yaml"
DESCRIPTION = """\
Trains an agent by DQN in any Gymnasium environment with single actions.

What isn't given comes from config/dqn.yaml: the section of --preset, or else that of the
environment. Every flag is a private rosparam too (~env_id, ~total_timesteps, ...). The command
line wins over rosparams, these over --params, and all of them over the file.
Ctrl-C saves everything and exits with 130 (SIGTERM: 143); --resume goes on from there, to the
same bits as a training that was never interrupted.
Exit codes: 0 done, 1 failed (what was learned is saved), 2 wrong arguments."""


@dataclass(frozen=True)
class RunSettings:
    """One training around the algorithm: where, how long, and what it leaves behind.

    Raises:
        WorkbenchError: if a value is beyond its limits.
    """

    env_id: str = option("CartPole-v1", "Gymnasium's id of the environment")
    env_kwargs: dict[str, Any] = option({}, "options of the environment, KEY=VALUE with commas")
    seed: int = option(0, "of weights, exploration, batches, environment, evaluation", 0, 2**31 - 1)
    episodes: int = option(
        0, "the training's length in episodes, if that comes first; 0: any", 0, 2**53
    )
    device: str = option("cpu", "torch's, as in cpu or cuda")
    exp_name: str = option("dqn", "in the run folder's name")
    run_dir: str = option("", "a new or empty folder for all results (runs/ENV__EXP__SEED__TIME)")
    eval_frequency: int = option(1_000, "steps between two evaluations; 0: never", 0, 2**53)
    eval_episodes: int = option(10, "greedy episodes of an evaluation", 1, 10**6)
    confirm_episodes: int = option(
        100, "greedy episodes that a policy needs to become the best one", 1, 10**6
    )
    stop_at_return: float | None = option(
        None, "ends the training when a confirmed mean return reaches it", -1e18, 1e18
    )
    checkpoint_frequency: int = option(
        5_000, "steps between two checkpoints; 0: at start and end only", 0, 2**53
    )
    keep_checkpoints: int = option(3, "the newest ones are kept; 0: all", 0, 10**6)
    log_frequency: int = option(500, "steps between two points of losses/", 1, 2**53)

    def __post_init__(self) -> None:
        check_options(self)
        if not self.env_id:
            raise WorkbenchError("env_id names an environment")
        if not is_plain(self.env_kwargs):
            raise WorkbenchError(
                f"env_kwargs has values that no file can hold: {self.env_kwargs}; texts, finite "
                "numbers, true, false, lists and mappings of these will do"
            )


class Choice(NamedTuple):
    """What the user wants: a new training by these settings, or an old one resumed."""

    run: RunSettings
    dqn: DQNSettings
    resume: Path | None


OPTIONS = Options(RunSettings, DQNSettings)
EXTENDING = ("total_timesteps", "episodes", "device")  # may be changed when resuming


def command_options() -> CommandOptions:
    """All flags; none has a default of its own."""
    result = argparse.ArgumentParser(
        COMMAND,
        usage=f"{COMMAND} [--help] [--OPTION VALUE ...]",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
        argument_default=argparse.SUPPRESS,
    )
    result.add_argument("--preset", metavar="NAME", help="a section of that file, as in: tutorial")
    return CommandOptions(result, OPTIONS, CONFIG, ("preset",))


def choose(flags: list[str], parameters: dict[str, Any]) -> Choice:
    """Defaults, overridden by the file, --params, rosparams and flags, in this order.

    Raises:
        SystemExit: with code 2 and a usage line, if a flag is wrong; with 0 after --help.
        WorkbenchError: if a name is unknown or a value wrong anywhere else.
    """
    given, special = command_options().given(flags, parameters)
    if special.get("resume"):
        return _resumed(Path(special["resume"]), given, special)
    origin = f"--config {special['config']}" if "config" in special else f"config/{CONFIG}"
    path = Path(special["config"]) if "config" in special else default_file(CONFIG)
    wanted = given.get("env_id", None if special.get("preset") else RunSettings().env_id)
    section = read_section(path, wanted, special.get("preset"))
    merged = {"env_id": wanted} if wanted else {}
    merged |= OPTIONS.read(section, origin) | given
    return Choice(OPTIONS.make(RunSettings, merged), OPTIONS.make(DQNSettings, merged), None)


def _resumed(folder: Path, given: dict[str, Any], special: dict[str, Any]) -> Choice:
    others = [name for name in given if name not in EXTENDING]
    others += [name for name in special if name != "resume"]
    if others:
        raise WorkbenchError(
            f"a resumed training keeps its settings: --resume allows no {flag(others[0])}, "
            f"only {', '.join(flag(name) for name in EXTENDING)}"
        )
    run, dqn = read_config(folder)
    merged = asdict(run) | asdict(dqn) | given
    return Choice(OPTIONS.make(RunSettings, merged), OPTIONS.make(DQNSettings, merged), folder)


def config(run: RunSettings, dqn: DQNSettings) -> dict[str, Any]:
    """Both as plain values, for config.json and checkpoints."""
    return {"algorithm": "dqn", "run": asdict(run), "dqn": asdict(dqn)}


def from_config(content: Any, origin: str) -> tuple[RunSettings, DQNSettings]:
    """What `config` gave, also after JSON.

    Raises:
        WorkbenchError: if it is something else.
    """
    record = content if isinstance(content, dict) else {}
    run, dqn = record.get("run"), record.get("dqn")
    if record.get("algorithm") != "dqn" or not (isinstance(run, dict) and isinstance(dqn, dict)):
        raise WorkbenchError(f"{origin} isn't the configuration of a DQN training")
    values = OPTIONS.read({**run, **dqn}, origin)
    return OPTIONS.make(RunSettings, values), OPTIONS.make(DQNSettings, values)


def check_same(run: RunSettings, dqn: DQNSettings, content: Any, origin: str) -> None:
    """Holds the settings to resume with against those in a checkpoint.

    Raises:
        WorkbenchError: if one differs that a resumed training can't change, or these are no settings.
    """
    before, after = (
        asdict(pair[0]) | asdict(pair[1]) for pair in (from_config(content, origin), (run, dqn))
    )
    for name, value in before.items():
        if name not in EXTENDING and after[name] != value:
            raise WorkbenchError(
                f"{origin}: {CONFIG_RECORD} says {name} {after[name]}, the checkpoint {value}; a "
                "resumed training keeps its settings"
            )


def read_config(folder: Path) -> tuple[RunSettings, DQNSettings]:
    """The settings of a training, from its folder.

    Raises:
        WorkbenchError: if there is none.
    """
    return from_config(read_record(folder), str(folder / CONFIG_RECORD))
