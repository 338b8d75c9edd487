"""Stable-Baselines3's algorithms by name."""

from functools import partial

from rl_workbench.training.options.kind import AlgorithmKind
from rl_workbench.training.sb3.options import CLASSES, options_class

_CONTINUOUS = ("sac", "td3", "ddpg")


def _kind(name: str) -> AlgorithmKind:
    env_id = "Pendulum-v1" if name in _CONTINUOUS else "CartPole-v1"
    return AlgorithmKind(
        name=name,
        about=f"an agent by Stable-Baselines3's {CLASSES[name]} in any Gymnasium environment that fits it",
        config="sb3.yaml",
        section=f"{name} {{env_id}}",
        implementation="rl_workbench.training.sb3.making",
        hyperparameters=partial(options_class, name),
        keeps_dict=True,
        learns_in_several=True,
        defaults={"env_id": env_id, "total_timesteps": 100_000},
        package=("stable_baselines3", "Stable-Baselines3"),
    )


SB3 = tuple(_kind(name) for name in CLASSES)
