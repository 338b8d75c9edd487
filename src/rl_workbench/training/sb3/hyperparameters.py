"""The options of Stable-Baselines3's algorithms, with the library's own defaults.

The defaults are written out here, because importing the library would add seconds to every `--help`. A test
compares them with the library's signatures.
"""

from dataclasses import dataclass, fields
from math import inf
from typing import Any, ClassVar

from rl_workbench.agents.settings import discount
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import check_options, is_plain, option

ON_POLICY = ("ppo", "a2c")


@dataclass(frozen=True, kw_only=True)
class SB3Options:
    """Options that all of the algorithms have."""

    library_class: ClassVar[str]

    learning_rate: float = option(3e-4, "learning rate", 0, inf)
    lr_schedule: str = option(
        "constant", "linear: falls to 0 over total_timesteps", choices=("constant", "linear")
    )
    gamma: float = discount()
    policy: str = option(
        "", "MlpPolicy, CnnPolicy or MultiInputPolicy, or one of your own as module:Class; by default what "
        "the observations need",
    )  # fmt: skip
    policy_kwargs: dict[str, Any] = option(
        {}, "arguments of the policy, KEY=VALUE with commas; classes as module:Class"
    )
    net_arch: Any = option(None, "units of the hidden layers, as in 64,64")
    log_std_init: float | None = option(None, "initial log of the policy's standard deviation")

    def __post_init__(self) -> None:
        check_options(self)
        for name, value in self.own.items():
            if not is_plain(value):
                raise WorkbenchError(f"{name} has a value that JSON can't hold: {value!r}")

    @property
    def own(self) -> dict[str, Any]:
        """The arguments of the algorithm's class and of its network."""
        ours = {"policy", "policy_kwargs", "lr_schedule", "her", "n_sampled_goal",
                "goal_selection_strategy", "demos"}  # fmt: skip
        return {each.name: getattr(self, each.name) for each in fields(self) if each.name not in ours}


@dataclass(frozen=True, kw_only=True)
class ExplorationOptions(SB3Options):
    """Generalised state-dependent exploration (gSDE)."""

    use_sde: bool = option(False, "state-dependent exploration, smoother than independent noise")
    sde_sample_freq: int = option(-1, "steps between new noise of use_sde; -1: once a rollout")


@dataclass(frozen=True, kw_only=True)
class OnPolicyOptions(ExplorationOptions):
    """Algorithms that learn from a rollout and then forget it."""

    n_steps: int = option(2048, "steps of a rollout in each environment", 1, inf)
    gae_lambda: float = option(0.95, "lambda of the generalised advantages", 0, 1)
    normalize_advantage: bool = option(True, "normalise the advantages")
    ent_coef: float = option(0.0, "weight of the entropy in the loss")
    vf_coef: float = option(0.5, "weight of the value function in the loss")
    max_grad_norm: float = option(0.5, "clips the gradient's norm")


@dataclass(frozen=True, kw_only=True)
class PPOOptions(OnPolicyOptions):
    library_class = "PPO"

    batch_size: int = option(64, "steps of a minibatch", 1, inf)
    n_epochs: int = option(10, "passes over a rollout", 1, inf)
    clip_range: float = option(0.2, "clips the ratio of probabilities")
    clip_range_vf: float | None = option(None, "clips the change of the value function")
    target_kl: float | None = option(None, "ends the passes at this divergence")


@dataclass(frozen=True, kw_only=True)
class A2COptions(OnPolicyOptions):
    library_class = "A2C"

    learning_rate: float = option(7e-4, "learning rate", 0, inf)
    n_steps: int = option(5, "steps of a rollout in each environment", 1, inf)
    gae_lambda: float = option(1.0, "lambda of the generalised advantages", 0, 1)
    normalize_advantage: bool = option(False, "normalise the advantages")
    rms_prop_eps: float = option(1e-5, "epsilon of RMSprop")
    use_rms_prop: bool = option(True, "RMSprop instead of Adam")


@dataclass(frozen=True, kw_only=True)
class OffPolicyOptions(SB3Options):
    """Algorithms with a replay buffer, which may be that of hindsight experience replay."""

    buffer_size: int = option(1_000_000, "size of the replay buffer [steps]", 1, inf)
    learning_starts: int = option(100, "steps before the first gradient step", 0, inf)
    batch_size: int = option(256, "steps of a minibatch", 1, inf)
    tau: float = option(0.005, "share of the new weights in a target network's update", 0, 1)
    train_freq: Any = option(1, "steps between two updates, or as in [1, episode]")
    gradient_steps: int = option(1, "gradient steps of an update; -1: as many as steps", -1, inf)
    optimize_memory_usage: bool = option(False, "share memory between successive observations")
    n_steps: int = option(1, "rewards summed before the estimate of the rest", 1, inf)
    her: bool = option(
        False, "hindsight experience replay, for environments with achieved_goal and desired_goal"
    )
    n_sampled_goal: int = option(4, "her: goals in hindsight for each real one", 1, 10**6)
    goal_selection_strategy: str = option(
        "future", "her: the goal is achieved later in the episode, at its end, or anywhere in it",
        choices=("future", "final", "episode"),
    )  # fmt: skip
    demos: str = option("", "a folder of demonstrations, which begin the replay buffer", metavar="FOLDER")


@dataclass(frozen=True, kw_only=True)
class SACOptions(OffPolicyOptions, ExplorationOptions):
    library_class = "SAC"

    action_noise: float | None = option(None, "standard deviation of noise on the actions")
    ent_coef: Any = option("auto", "weight of the entropy; auto learns it, auto_0.1 from there on")
    target_update_interval: int = option(1, "gradient steps between updates of the target", 1, inf)
    target_entropy: Any = option("auto", "entropy that auto aims at")
    use_sde_at_warmup: bool = option(False, "use_sde also before learning_starts")


@dataclass(frozen=True, kw_only=True)
class DDPGOptions(OffPolicyOptions):
    library_class = "DDPG"

    learning_rate: float = option(1e-3, "learning rate", 0, inf)
    action_noise: float | None = option(None, "standard deviation of noise on the actions")


@dataclass(frozen=True, kw_only=True)
class TD3Options(DDPGOptions):
    library_class = "TD3"

    policy_delay: int = option(2, "updates of the critics for each of the policy", 1, inf)
    target_policy_noise: float = option(0.2, "standard deviation of noise on the target's actions")
    target_noise_clip: float = option(0.5, "largest such noise")


@dataclass(frozen=True, kw_only=True)
class DQNOptions(OffPolicyOptions):
    library_class = "DQN"

    learning_rate: float = option(1e-4, "learning rate", 0, inf)
    batch_size: int = option(32, "steps of a minibatch", 1, inf)
    tau: float = option(1.0, "share of the new weights in a target network's update", 0, 1)
    train_freq: Any = option(4, "steps between two updates, or as in [1, episode]")
    target_update_interval: int = option(10_000, "steps between two updates of the target network", 1, inf)
    exploration_fraction: float = option(0.1, "share of total_timesteps until exploration_final_eps", 0, 1)
    exploration_initial_eps: float = option(1.0, "probability of a random action at first", 0, 1)
    exploration_final_eps: float = option(0.05, "probability of a random action in the end", 0, 1)
    max_grad_norm: float = option(10.0, "clips the gradient's norm")
