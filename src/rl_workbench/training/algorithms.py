"""The algorithms that `--algo` knows. An algorithm is imported only when it is used."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import unknown

_TRAINING = "rl_workbench.training"
_SETTINGS = "rl_workbench.agents.settings"


@dataclass(frozen=True)
class AlgorithmKind:
    """What the command line and a record need to know of an algorithm."""

    name: str  # the value of `--algo`, also written into records
    about: str  # what it trains, for `--help`
    config: str  # the file with tuned options below `config/`
    implementation: str  # the module with `make` and `load_policy`; see `algorithm`
    settings: str  # the dataclass of the algorithm's own options, as `module:Class`
    section: str = "{env_id}"  # the name of an environment's section in the file
    defaults: Mapping[str, Any] = field(default_factory=dict)  # common options that differ here
    keeps_dict: bool = False  # learns from a Dict of arrays as it is, others from one flat vector
    learns_in_several: bool = False  # environments at the same time
    package: tuple[str, str] | None = None  # the optional one that it needs, as (module, name)

    def hyperparameters(self) -> Any:
        """Returns the dataclass of the algorithm's own options."""
        module, _, name = self.settings.partition(":")
        return getattr(import_module(module), name)


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
    AlgorithmKind(
        name="bc",
        about="a policy by behaviour cloning of demonstrations (--demos), from vectors or images",
        config="bc.yaml",
        implementation=f"{_TRAINING}.bc",
        settings=f"{_SETTINGS}:CloningSettings",
        keeps_dict=True,
        defaults={
            "total_timesteps": 4_000,
            "eval_frequency": 2_000,
            "eval_episodes": 20,
            "checkpoint_frequency": 1_000,
        },
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
