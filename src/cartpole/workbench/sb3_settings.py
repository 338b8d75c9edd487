"""What a training with Stable-Baselines3 can be told: flags, KEY=VALUE and config/sb3.yaml."""

import argparse
import inspect
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from cartpole.errors import CartpoleError
from cartpole.option import check_options, option
from cartpole.training.config_file import default_file, read_section
from cartpole.training.options import Options, key_values, unknown
from cartpole.workbench.extras import need

CONFIG = "sb3.yaml"
CLASSES = {"ppo": "PPO", "a2c": "A2C", "sac": "SAC", "td3": "TD3", "ddpg": "DDPG", "dqn-sb3": "DQN"}
ON_POLICY = ("ppo", "a2c")
OURS = ("self", "policy", "env", "seed", "device", "verbose", "tensorboard_log", "_init_setup_model",
        "stats_window_size", "policy_kwargs")  # fmt: skip
NETWORK = ("net_arch", "log_std_init")  # of policy_kwargs, given like any other option


@dataclass(frozen=True)
class SB3Run:
    """One training around the algorithm.

    Raises:
        CartpoleError: if a value is beyond its limits.
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
    device: str = option("cpu", "torch's, as in cpu or cuda")

    def __post_init__(self) -> None:
        check_options(self)
        if not self.env_id:
            raise CartpoleError("env_id names an environment")


class SB3Choice(NamedTuple):
    """What the user wants."""

    algorithm: str  # a name of CLASSES
    run: SB3Run
    hyperparameters: dict[str, Any]  # of the algorithm's class, as in the file


OPTIONS = Options(SB3Run)


def algorithm_class(name: str) -> Any:
    """Stable-Baselines3's class.

    Raises:
        CartpoleError: if it isn't installed.
    """
    need("stable_baselines3", "Stable-Baselines3", f"the algorithm {name}")
    import stable_baselines3

    return getattr(stable_baselines3, CLASSES[name])


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Those of the command `train`."""
    parser.add_argument("--algo", required=True, choices=tuple(CLASSES), help="the algorithm")
    parser.add_argument("--config", type=Path, metavar="FILE", help=f"options (config/{CONFIG})")
    parser.add_argument("--params", nargs="+", default=[], metavar="KEY=VALUE",
                        help="any option of this list or of the algorithm's class")  # fmt: skip
    OPTIONS.add_flags(parser)


def choose(arguments: argparse.Namespace) -> SB3Choice:
    """Defaults, overridden by the file's section, --params and flags, in this order.

    Raises:
        CartpoleError: if an option is unknown or wrong, or the algorithm isn't installed.
    """
    name = arguments.algo
    flags = {key: value for key, value in vars(arguments).items() if key in OPTIONS.names}
    listed = {
        key: yaml.safe_load(value)
        for key, value in key_values(arguments.params, "--params").items()
    }
    path = arguments.config or default_file(CONFIG)
    env_id = flags.get("env_id") or listed.get("env_id") or SB3Run().env_id
    section = read_section(path, f"{name} {env_id}", None)
    merged = {"exp_name": name, "env_id": env_id}
    hyperparameters: dict[str, Any] = {}
    for values, origin in ((section, str(path)), (listed, "--params")):
        run, own = _separated(name, values, origin)
        merged |= run
        hyperparameters |= own
    return SB3Choice(name, OPTIONS.make(SB3Run, merged | flags), hyperparameters)


def _separated(
    name: str, values: dict[str, Any], origin: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Options of the run, and those of the algorithm's class."""
    run = {key: value for key, value in values.items() if key in OPTIONS.names}
    own = {key: value for key, value in values.items() if key not in OPTIONS.names}
    known = hyperparameter_names(name)
    for key in own:
        if key not in known:
            text = unknown(f"option of {name}", key, [*OPTIONS.names, *known])
            raise CartpoleError(f"{origin}: {text}")
    return OPTIONS.read(run, origin), own


def hyperparameter_names(name: str) -> list[str]:
    """Of the algorithm's class, and of its network."""
    parameters = inspect.signature(algorithm_class(name).__init__).parameters
    return [*(key for key in parameters if key not in OURS), *NETWORK]


def record(choice: SB3Choice) -> dict[str, Any]:
    """All of it as plain values, for config.json and checkpoints."""
    return {
        "algorithm": choice.algorithm,
        "run": asdict(choice.run),
        "sb3": choice.hyperparameters,
    }


def from_record(content: dict[str, Any], origin: str) -> SB3Choice:
    """What `record` gave, also after JSON.

    Raises:
        CartpoleError: if it is something else.
    """
    if content.get("algorithm") not in CLASSES or "sb3" not in content:
        raise CartpoleError(f"{origin} isn't the configuration of a training known here")
    run = OPTIONS.make(SB3Run, OPTIONS.read(content["run"], origin))
    return SB3Choice(content["algorithm"], run, dict(content["sb3"]))


def with_folder(choice: SB3Choice, folder: Path) -> SB3Choice:
    """The same training with its results in a folder."""
    return choice._replace(run=replace(choice.run, run_dir=str(folder)))
