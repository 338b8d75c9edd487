"""What a training with Stable-Baselines3 can be told: flags, KEY=VALUE and config/sb3.yaml."""

import argparse
import inspect
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from rl_workbench.errors import WorkbenchError
from rl_workbench.extras import need
from rl_workbench.option import check_options, option
from rl_workbench.training.options.config_file import default_file, read_section
from rl_workbench.training.options.options import Options, key_values, unknown
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.record import read_record
from rl_workbench.training.sb3.limits import check_limits

CONFIG = "sb3.yaml"
COMMAND = "workbench.py train"
CLASSES = {"ppo": "PPO", "a2c": "A2C", "sac": "SAC", "td3": "TD3", "ddpg": "DDPG", "dqn-sb3": "DQN"}
ON_POLICY = ("ppo", "a2c")
OURS = ("self", "policy", "env", "seed", "device", "verbose", "tensorboard_log", "_init_setup_model",
        "stats_window_size", "policy_kwargs", "replay_buffer_class", "replay_buffer_kwargs",
        "rollout_buffer_class", "rollout_buffer_kwargs")  # fmt: skip
SPECIAL: tuple[str, ...] = ("config", "params", "resume")
EXTENDING = ("total_timesteps", "device")  # may be changed when resuming
NETWORK = ("net_arch", "log_std_init")  # of policy_kwargs, given like any other option


@dataclass(frozen=True)
class SB3Run:
    """One training around the algorithm.

    Raises:
        WorkbenchError: if a value is beyond its limits.
    """

    env_id: str = option("cartpole/SwingUp-v0", "Gymnasium's id of the environment")
    env_kwargs: dict[str, Any] = option({}, "options of the environment, KEY=VALUE with commas")
    seed: int = option(0, "of weights, exploration, environments, evaluation", 0, 2**31 - 1)
    total_timesteps: int = option(100_000, "the training's length [steps]", 1, 2**53)
    n_envs: int = option(1, "environments that are stepped in turn", 1, 1024)
    lr_schedule: str = option(
        "constant", "linear: falls to 0 over total_timesteps", choices=("constant", "linear")
    )
    exp_name: str = option("", "in the run folder's name (the algorithm's)")
    run_dir: str = option("", "a new or empty folder for all results (runs/ENV__EXP__SEED__TIME)")
    eval_frequency: int = option(10_000, "steps between two evaluations; 0: never", 0, 2**53)
    eval_episodes: int = option(10, "greedy episodes of an evaluation", 1, 10**6)
    confirm_episodes: int = option(
        0, "greedy episodes that a policy needs to become the best one; 0: those of the evaluation",
        0, 10**6,
    )  # fmt: skip
    checkpoint_frequency: int = option(
        10_000, "steps between two checkpoints; 0: with evaluations and at the end", 0, 2**53
    )
    keep_checkpoints: int = option(3, "the newest ones are kept; 0: all", 0, 10**6)
    device: str = option("cpu", "torch's, as in cpu or cuda")

    def __post_init__(self) -> None:
        check_options(self)
        if not self.env_id:
            raise WorkbenchError("env_id names an environment")


class SB3Choice(NamedTuple):
    """What the user wants: a new training by these settings, or an old one resumed."""

    algorithm: str  # a name of CLASSES
    run: SB3Run
    hyperparameters: dict[str, Any]  # all of the algorithm's class
    resume: Path | None = None


OPTIONS = Options(SB3Run)


def algorithm_class(name: str) -> Any:
    """Stable-Baselines3's class.

    Raises:
        WorkbenchError: if it isn't installed.
    """
    need("stable_baselines3", "Stable-Baselines3", f"the algorithm {name}")
    import stable_baselines3

    return getattr(stable_baselines3, CLASSES[name])


def parser(name: str) -> argparse.ArgumentParser:
    """All flags of `train` for an algorithm; none has a default of its own.

    Raises:
        WorkbenchError: if the algorithm isn't installed.
    """
    result = argparse.ArgumentParser(
        f"{COMMAND} --algo {name}",
        description=f"Trains with Stable-Baselines3's {CLASSES[name]}.",
        allow_abbrev=False,
        argument_default=argparse.SUPPRESS,
    )
    result.add_argument("--config", type=Path, metavar="FILE", help=f"options (config/{CONFIG})")
    result.add_argument("--params", nargs="+", metavar="KEY=VALUE", help="options by name")
    result.add_argument("--resume", type=Path, metavar="RUN", help="go on with a training: with its "
                        "networks, optimizers, replay buffer and figures, but with a new episode "
                        "and other random numbers, so not to the same bits")  # fmt: skip
    OPTIONS.add_flags(result)
    own = result.add_argument_group(f"{CLASSES[name]}'s own, explained in its documentation")
    for key, default in defaults(name).items():
        flag, text = f"--{key.replace('_', '-')}", f"default {default}".replace("%", "%%")
        if isinstance(default, bool):
            own.add_argument(flag, action=argparse.BooleanOptionalAction, help=text)
        else:
            own.add_argument(flag, type=plain_value, metavar="VALUE", help=text)
    return result


def choose(name: str, flags: list[str]) -> SB3Choice:
    """Defaults, overridden by the file's section, --params and flags, in this order.

    Args:
        name: of the algorithm.
        flags: as on the command line.

    Raises:
        SystemExit: with code 2 and a usage line, if a flag is wrong; with 0 after --help.
        WorkbenchError: if an option is unknown or wrong, or the algorithm isn't installed.
    """
    reading = parser(name)
    known, strange = reading.parse_known_args(flags)
    if strange:
        names = [f"--{key.replace('_', '-')}" for key in (*OPTIONS.names, *defaults(name))]
        reading.error(unknown("flag", strange[0].partition("=")[0], names))
    given = vars(known)
    special = {key: given.pop(key) for key in SPECIAL if key in given}
    if "resume" in special:
        return _resumed(name, special, given)
    listed = key_values(special.get("params", []), "--params")
    given = {key: plain_value(value) for key, value in listed.items()} | given
    path = special.get("config") or default_file(CONFIG)
    env_id = given.get("env_id") or SB3Run().env_id
    section = read_section(path, f"{name} {env_id}", None)
    merged = {"exp_name": name, "env_id": env_id}
    hyperparameters = defaults(name)
    for values, origin in ((section, str(path)), (given, "--params")):
        run, own = _separated(name, values, origin)
        merged |= run
        hyperparameters |= own
    check_limits(hyperparameters)
    return SB3Choice(name, OPTIONS.make(SB3Run, merged), hyperparameters)


def _resumed(name: str, special: dict[str, Any], given: dict[str, Any]) -> SB3Choice:
    others = [key for key in (*special, *given) if key not in ("resume", *EXTENDING)]
    if others:
        raise WorkbenchError(
            f"a resumed training keeps its settings: --resume allows no "
            f"--{others[0].replace('_', '-')}, only --total-timesteps and --device"
        )
    folder = special["resume"]
    choice = from_record(read_record(folder), str(folder))
    if choice.algorithm != name:
        raise WorkbenchError(f"{folder} was trained by {choice.algorithm}, not by {name}")
    return choice._replace(run=replace(choice.run, **given), resume=folder)


def _separated(
    name: str, values: dict[str, Any], origin: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Options of the run, and those of the algorithm's class."""
    run = {key: value for key, value in values.items() if key in OPTIONS.names}
    own = {key: plain_value(values[key]) for key in values if key not in OPTIONS.names}
    known = hyperparameter_names(name)
    for key in own:
        if key not in known:
            text = unknown(f"option of {name}", key, [*OPTIONS.names, *known])
            raise WorkbenchError(f"{origin}: {text}")
    return OPTIONS.read(run, origin), own


def plain_value(value: Any) -> Any:
    """A text as a YAML value; 1e-3 is a number, too, which YAML writes 1.0e-3."""
    if not isinstance(value, str):
        return value
    try:
        value = yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise WorkbenchError(f"{value!r} isn't a value: {' '.join(str(error).split())}") from error
    try:
        number = float(value) if isinstance(value, str) else value
    except ValueError:
        return value
    is_whole = isinstance(value, str) and number.is_integer() and abs(number) >= 1
    return int(number) if is_whole else number


def defaults(name: str) -> dict[str, Any]:
    """The options of the algorithm's class, and of its network, as they are if nobody says more.

    Raises:
        WorkbenchError: if it isn't installed.
    """
    parameters = inspect.signature(algorithm_class(name).__init__).parameters
    own = {key: each.default for key, each in parameters.items() if key not in OURS}
    return own | dict.fromkeys(NETWORK)


def hyperparameter_names(name: str) -> list[str]:
    """Of the algorithm's class, and of its network."""
    return list(defaults(name))


def record(choice: SB3Choice) -> dict[str, Any]:
    """All of it as plain values, for config.json and checkpoints."""
    return {
        "algorithm": choice.algorithm,
        "run": asdict(choice.run),
        "sb3": choice.hyperparameters,
    }


def from_record(content: Any, origin: str) -> SB3Choice:
    """What `record` gave, also after JSON.

    Raises:
        WorkbenchError: if it is something else.
    """
    known = isinstance(content, dict) and {"algorithm", "run", "sb3"} <= set(content)
    if not known or content["algorithm"] not in CLASSES:
        raise WorkbenchError(f"{origin} isn't the configuration of a training known here")
    run = OPTIONS.make(SB3Run, OPTIONS.read(content["run"], origin))
    return SB3Choice(content["algorithm"], run, dict(content["sb3"]))


def sb3_versions() -> dict[str, str]:
    """What the figures depend on."""
    from stable_baselines3 import __version__

    return {**run_folder.versions(), "stable_baselines3": __version__}
