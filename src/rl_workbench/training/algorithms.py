"""The algorithms that `--algo` knows. An algorithm is imported only when it is used."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from rl_workbench.errors import WorkbenchError, need
from rl_workbench.option import unknown

_TRAINING = "rl_workbench.training"
_SETTINGS = "rl_workbench.agents.settings"


@dataclass(frozen=True)
class AlgorithmKind:
    """What the command line and a record need to know of an algorithm.

    Args:
        name: The value of `--algo`, also written into records.
        about: What it trains, for `--help`.
        config: The file with tuned options below `config/`.
        implementation: The module with `make` and `load_policy`; see `algorithm`.
        settings: The dataclass of the algorithm's own options, as `module:Class`.
        section: The name of an environment's section in that file.
        defaults: Common options whose default differs for this algorithm.
        keeps_dict: Whether it learns from a Dict of arrays as it is. The others get one flat vector.
        learns_in_several: Whether it learns in several environments at the same time.
        package: The optional package that it needs, as (module, name).
    """

    name: str
    about: str
    config: str
    implementation: str
    settings: str
    section: str = "{env_id}"
    defaults: Mapping[str, Any] = field(default_factory=dict)
    keeps_dict: bool = False
    learns_in_several: bool = False
    package: tuple[str, str] | None = None

    def hyperparameters(self) -> Any:
        """Returns the dataclass of the algorithm's own options."""
        module, _, name = self.settings.partition(":")
        return getattr(import_module(module), name)

    def check_installed(self) -> None:
        """Makes sure that the package it needs is installed."""
        if self.package:
            need(*self.package, f"the algorithm {self.name}")


_EPISODIC = {"episodes": 600, "eval_frequency": 0, "eval_episodes": 20}
_OURS = (
    AlgorithmKind(
        name="dqn",
        about="an agent by DQN in any Gymnasium environment with discrete actions",
        config="dqn.yaml",
        implementation=f"{_TRAINING}.dqn",
        settings=f"{_SETTINGS}:DQNSettings",
        defaults={
            "total_timesteps": 50_000,
            "eval_frequency": 1_000,
            "confirm_episodes": 100,
            "checkpoint_frequency": 5_000,
        },
    ),
    AlgorithmKind(
        name="reinforce",
        about="a policy by REINFORCE with a fitted baseline and generalised advantages\n"
        "in any Gymnasium environment with discrete or continuous actions",
        config="pg.yaml",
        implementation=f"{_TRAINING}.pg",
        settings=f"{_SETTINGS}:ReinforceSettings",
        learns_in_several=True,
        defaults={**_EPISODIC, "normalize_observations": True},
    ),
    AlgorithmKind(
        name="reinforce-document",
        about="a linear policy by the policy-gradient document's algorithm,\n"
        "in an environment with 4 observations and 2 actions",
        config="pg.yaml",
        section="reinforce-document {env_id}",
        implementation=f"{_TRAINING}.pg",
        settings=f"{_SETTINGS}:DocumentSettings",
        defaults=_EPISODIC,
    ),
)


def _stable_baselines(name: str, library_class: str, env_id: str = "CartPole-v1") -> AlgorithmKind:
    return AlgorithmKind(
        name=name,
        about=f"an agent by Stable-Baselines3's {library_class} in any Gymnasium environment that fits it",
        config="sb3.yaml",
        section=f"{name} {{env_id}}",
        implementation=f"{_TRAINING}.sb3.adapter",
        settings=f"{_TRAINING}.sb3.hyperparameters:{library_class}Options",
        keeps_dict=True,
        learns_in_several=True,
        defaults={"env_id": env_id, "total_timesteps": 100_000},
        package=("stable_baselines3", "Stable-Baselines3"),
    )


_THEIRS = (
    _stable_baselines("ppo", "PPO"),
    _stable_baselines("a2c", "A2C"),
    _stable_baselines("sac", "SAC", "Pendulum-v1"),
    _stable_baselines("td3", "TD3", "Pendulum-v1"),
    _stable_baselines("ddpg", "DDPG", "Pendulum-v1"),
    _stable_baselines("dqn-sb3", "DQN"),
)
ALGORITHMS = {kind.name: kind for kind in (*_OURS, *_THEIRS)}


def algorithm(name: str) -> AlgorithmKind:
    """Returns the algorithm of that name."""
    if name not in ALGORITHMS:
        raise WorkbenchError(unknown("algorithm", name, list(ALGORITHMS)))
    return ALGORITHMS[name]
