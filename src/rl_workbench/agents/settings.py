"""The options of this project's own algorithms, with defaults and limits."""

from dataclasses import dataclass

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import check_options, option


def discount() -> float:
    """Returns the option gamma, which all algorithms have."""
    return option(0.99, "discount factor", 0, 1)


@dataclass(frozen=True)
class DQNSettings:
    """The options of DQN. Steps are environment steps, unless called gradient steps."""

    total_timesteps: int = option(50_000, "length of the training [steps]; schedules span it", 1, 2**53)
    learning_rate: float = option(1e-3, "learning rate of Adam", 0, 10)
    lr_schedule: str = option(
        "constant",
        "how the learning rate changes; linear: falls to 0 over total_timesteps",
        choices=("constant", "linear"),
    )
    buffer_size: int = option(50_000, "capacity of the replay buffer [transitions]", 1, 2**31)
    learning_starts: int = option(1_000, "steps before the first gradient step", 0, 2**53)
    batch_size: int = option(
        64, "transitions per gradient step; fewer while the buffer holds fewer", 1, 2**24
    )
    train_frequency: int = option(1, "steps between rounds of learning", 1, 2**31)
    gradient_steps: int = option(1, "gradient steps in each round of learning", 1, 2**24)
    gamma: float = discount()
    n_step: int = option(1, "rewards summed before bootstrapping from the value estimate", 1, 10_000)
    double: bool = option(
        True, "double DQN: the network picks the next action, the target network evaluates it"
    )
    dueling: bool = option(False, "dueling network: separate outputs for the state value and the advantages")
    hidden_sizes: tuple[int, ...] = option((128, 128), "units in each hidden layer")
    loss: str = option("huber", "loss function applied to the TD error", choices=("mse", "huber"))
    max_grad_norm: float = option(10.0, "clip the gradient to this norm; 0: no clipping", 0, 1e18)
    reward_scale: float = option(1.0, "factor that multiplies rewards", -1e9, 1e9)
    target_network_frequency: int = option(
        250, "gradient steps between updates of the target network", 1, 2**31
    )
    tau: float = option(1.0, "share of the new weights in each target update; 1: a full copy", 0, 1)
    epsilon_schedule: str = option(
        "linear",
        "how exploration falls; step or episode: epsilon is multiplied by epsilon_decay after each "
        "round of learning or each episode",
        choices=("linear", "step", "episode"),
    )
    start_e: float = option(1.0, "probability of a random action at the start", 0, 1)
    end_e: float = option(0.02, "probability of a random action at the end", 0, 1)
    exploration_fraction: float = option(
        0.2, "fraction of total_timesteps over which the linear schedule reaches end_e", 0, 1
    )
    epsilon_decay: float = option(0.995, "decay factor of the step and episode schedules", 0, 1)
    normalize_observations: bool = option(
        False, "normalise observations by their running mean and standard deviation"
    )
    bootstrap_truncated: bool = option(
        True, "bootstrap from the last state when a time limit ends the episode"
    )

    def __post_init__(self) -> None:
        check_options(self)
        if not self.hidden_sizes or min(self.hidden_sizes) < 1:
            raise WorkbenchError(
                f"hidden_sizes must be one or more positive numbers, not {self.hidden_sizes}"
            )


@dataclass(frozen=True)
class ReinforceSettings:
    """The options of REINFORCE."""

    gamma: float = discount()
    gae_lambda: float = option(
        0.95, "lambda of generalised advantage estimation; 1: full returns, 0: one step", 0, 1
    )
    policy_learning_rate: float = option(0.03, "learning rate of the policy", 0, 10)
    value_learning_rate: float = option(0.01, "learning rate of the baseline", 0, 10)
    value_epochs: int = option(20, "gradient steps of the baseline for each batch", 0, 10**6)
    batch_episodes: int = option(1, "episodes for each gradient step of the policy", 1, 10**6)
    entropy_coefficient: float = option(0.0, "weight of the policy's entropy in its loss", 0, 1e6)
    policy_hidden: int = option(0, "units in the policy's hidden layer; 0: a linear policy", 0, 2**16)
    log_std_init: float = option(
        -0.5, "continuous actions: log of the initial standard deviation, in units of half their range",
        -4, 4,
    )  # fmt: skip
    value_hidden: int = option(32, "units in each of the baseline's two layers", 1, 2**16)
    normalize_observations: bool = option(
        False, "normalise observations by their running mean and standard deviation, if no scale is known"
    )
    observation_scale: tuple[float, ...] = option(
        (), "divisor of each element of an observation; empty: no scaling"
    )
    save_every: int = option(
        100, "episodes between saves of the networks as .pth; 0: only at the end", 0, 2**31 - 1
    )

    def __post_init__(self) -> None:
        check_options(self)
        if not all(each > 0.0 for each in self.observation_scale):
            raise WorkbenchError(f"observation_scale must be positive, not {self.observation_scale}")


@dataclass(frozen=True)
class CloningSettings:
    """The options of behaviour cloning. Steps are gradient steps."""

    demos: str = option("", "folder of demonstrations, as `demonstrate` writes them", metavar="FOLDER")
    learning_rate: float = option(1e-3, "learning rate of AdamW", 0, 10)
    weight_decay: float = option(1e-4, "share of the weights that a step takes away, by the rate", 0, 1)
    batch_size: int = option(256, "moments of demonstrations per gradient step", 1, 2**24)
    hidden_sizes: tuple[int, ...] = option((256, 256), "units in each hidden layer")

    def __post_init__(self) -> None:
        check_options(self)
        if min(self.hidden_sizes, default=1) < 1:
            raise WorkbenchError(f"hidden_sizes must be positive, not {self.hidden_sizes}")


@dataclass(frozen=True)
class DocumentSettings:
    """The options of the policy-gradient document's algorithm, which are constants in its script."""

    gamma: float = discount()
    policy_learning_rate: float = option(0.01, "learning rate of the policy", 0, 10)
    value_learning_rate: float = option(0.1, "learning rate of the value network", 0, 10)
    random_weights: bool = option(
        False, "draw all initial weights at random, as the script does; else the output layers "
        "start at zero, which learns more reliably",
    )  # fmt: skip
    save_every: int = option(
        100, "episodes between saves of the networks as .pth; 0: only at the end", 0, 2**31 - 1
    )

    def __post_init__(self) -> None:
        check_options(self)
