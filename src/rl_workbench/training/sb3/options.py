"""The options of Stable-Baselines3's algorithms, as a dataclass made from each class's signature."""

import dataclasses
import inspect
from functools import lru_cache
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import check_options, option
from rl_workbench.training.options.record import is_plain

CLASSES = {"ppo": "PPO", "a2c": "A2C", "sac": "SAC", "td3": "TD3", "ddpg": "DDPG", "dqn-sb3": "DQN"}
ON_POLICY = ("ppo", "a2c")
STRATEGIES = ("future", "final", "episode")
FRAMES_OWN = ("self", "policy", "env", "seed", "device", "verbose", "tensorboard_log",
              "_init_setup_model", "stats_window_size", "policy_kwargs", "replay_buffer_class",
              "replay_buffer_kwargs", "rollout_buffer_class", "rollout_buffer_kwargs")  # fmt: skip
NETWORK = ("net_arch", "log_std_init")  # of policy_kwargs, given like any other option
INFINITE = float("inf")
LIMITS = {  # that the library doesn't check itself; whole numbers where they begin with one
    "gamma": (0.0, 1.0),
    "gae_lambda": (0.0, 1.0),
    "tau": (0.0, 1.0),
    "n_epochs": (1, INFINITE),
    "n_steps": (1, INFINITE),
    "batch_size": (1, INFINITE),
    "buffer_size": (1, INFINITE),
    "learning_starts": (0, INFINITE),
    "policy_delay": (1, INFINITE),
    "target_update_interval": (1, INFINITE),
    "exploration_fraction": (0.0, 1.0),
    "exploration_initial_eps": (0.0, 1.0),
    "exploration_final_eps": (0.0, 1.0),
}


@dataclasses.dataclass(frozen=True)
class SB3Options:
    """What we add to an algorithm's own options.

    Raises:
        WorkbenchError: if a value is beyond its limits, or none that a record can hold.
    """

    lr_schedule: str = option(
        "constant", "linear: falls to 0 over total_timesteps", choices=("constant", "linear")
    )

    def __post_init__(self) -> None:
        check_options(self)
        for name, value in self.own.items():
            if not is_plain(value):
                raise WorkbenchError(f"{name} has a value that no file can hold: {value!r}")
        for name, (lowest, highest) in LIMITS.items():
            value = getattr(self, name, lowest)
            if not _lies_within(value, lowest, highest):
                kind = "a whole number" if isinstance(lowest, int) else "a number"
                until = "on" if highest == INFINITE else f"to {highest:g}"
                raise WorkbenchError(f"{name} is {kind} from {lowest:g} {until}, not {value!r}")

    @property
    def own(self) -> dict[str, Any]:
        """The options of the algorithm's class, and of its network."""
        ours = {each.name for each in dataclasses.fields(OffPolicyOptions)}
        return {key: value for key, value in vars(self).items() if key not in ours}


@dataclasses.dataclass(frozen=True)
class OffPolicyOptions(SB3Options):
    """What we add to those of an algorithm with a replay buffer: those of HerReplayBuffer."""

    her: bool = option(
        False, "hindsight experience replay, for environments with achieved_goal and desired_goal"
    )
    n_sampled_goal: int = option(4, "her: goals in hindsight for each real one", 1, 10**6)
    goal_selection_strategy: str = option(
        "future", "her: the hindsight goal is what the episode achieves later, in the end, or ever",
        choices=STRATEGIES,
    )  # fmt: skip


def _lies_within(value: Any, lowest: float, highest: float) -> bool:
    kinds = int if isinstance(lowest, int) else (int, float)
    return isinstance(value, kinds) and not isinstance(value, bool) and lowest <= value <= highest


def algorithm_class(name: str) -> Any:
    """Stable-Baselines3's class, which must be installed."""
    import stable_baselines3

    return getattr(stable_baselines3, CLASSES[name])


@lru_cache(maxsize=len(CLASSES))
def options_class(name: str) -> type:
    """A dataclass of all options of an algorithm, with the library's own defaults.

    Args:
        name: one of CLASSES.
    """
    parameters = inspect.signature(algorithm_class(name).__init__).parameters
    own = {key: each.default for key, each in parameters.items() if key not in FRAMES_OWN}
    about = f"{CLASSES[name]}'s own, see its documentation"
    return dataclasses.make_dataclass(
        f"{CLASSES[name]}Options",
        [
            (key, bool if isinstance(default, bool) else Any, _field(default, about))
            for key, default in (own | dict.fromkeys(NETWORK)).items()
        ],
        bases=(SB3Options if name in ON_POLICY else OffPolicyOptions,),
        frozen=True,
    )


def _field(default: Any, about: str) -> Any:
    if isinstance(default, tuple):
        default = list(default)  # as a record has it
    if isinstance(default, list):
        metadata = {"help": about, "limits": None, "choices": None}
        return dataclasses.field(default_factory=default.copy, metadata=metadata)
    return option(default, about)
