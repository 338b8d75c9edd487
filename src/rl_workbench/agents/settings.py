"""The options of this project's own algorithms, with defaults and limits."""

from dataclasses import dataclass

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import check_options, option


@dataclass(frozen=True)
class DQNSettings:
    """The options of DQN. Steps are environment steps, unless called gradient steps."""

    total_timesteps: int = option(
        50_000, "the training's length [steps]; schedules are fractions of it", 1, 2**53
    )
    learning_rate: float = option(1e-3, "of Adam", 0, 10)
    lr_schedule: str = option(
        "constant", "linear: falls to 0 over total_timesteps", choices=("constant", "linear")
    )
    buffer_size: int = option(50_000, "of the replay buffer [transitions]", 1, 2**31)
    learning_starts: int = option(1_000, "steps before the first gradient step", 0, 2**53)
    batch_size: int = option(64, "[transitions]; a smaller buffer gives what it has", 1, 2**24)
    train_frequency: int = option(1, "steps between two rounds of learning", 1, 2**31)
    gradient_steps: int = option(1, "gradient steps in one round", 1, 2**24)
    gamma: float = option(0.99, "discount factor", 0, 1)
    n_step: int = option(1, "rewards summed up before the estimate of the rest", 1, 10_000)
    double: bool = option(True, "the network picks the next action, the target network rates it")
    dueling: bool = option(False, "the network tells the state's value from the advantages")
    hidden_sizes: tuple[int, ...] = option((128, 128), "units of the hidden layers")
    loss: str = option("huber", "of the TD error", choices=("mse", "huber"))
    max_grad_norm: float = option(10.0, "clips the gradient's norm; 0: never", 0, 1e18)
    reward_scale: float = option(1.0, "rewards are multiplied by it", -1e9, 1e9)
    target_network_frequency: int = option(
        250, "gradient steps between two updates of the target network", 1, 2**31
    )
    tau: float = option(1.0, "share of the new weights in an update; 1: a copy", 0, 1)
    epsilon_schedule: str = option(
        "linear",
        "of exploration; step, episode: times epsilon_decay after each round of learning, or "
        "after each episode",
        choices=("linear", "step", "episode"),
    )
    start_e: float = option(1.0, "probability of a random action at the start", 0, 1)
    end_e: float = option(0.02, "and at the end", 0, 1)
    exploration_fraction: float = option(
        0.2, "of total_timesteps until end_e, for the linear schedule", 0, 1
    )
    epsilon_decay: float = option(0.995, "factor of the step and episode schedules", 0, 1)
    normalize_observations: bool = option(False, "by their running mean and deviation")
    bootstrap_truncated: bool = option(
        True, "a time limit doesn't end the world: its last state keeps its value"
    )

    def __post_init__(self) -> None:
        check_options(self)
        if not self.hidden_sizes or min(self.hidden_sizes) < 1:
            raise WorkbenchError(f"hidden_sizes are positive, one or more: {self.hidden_sizes}")


@dataclass(frozen=True)
class ReinforceSettings:
    """The options of REINFORCE."""

    gamma: float = option(0.99, "discount of rewards, for each step that they come later", 0, 1)
    gae_lambda: float = option(
        0.95, "of the generalised advantages; 1: whole returns, 0: one step", 0, 1
    )
    policy_learning_rate: float = option(0.03, "of the policy's Adam", 0, 10)
    value_learning_rate: float = option(0.01, "of the baseline's Adam", 0, 10)
    value_epochs: int = option(20, "steps of the baseline for each batch", 0, 10**6)
    batch_episodes: int = option(1, "episodes for each step of the policy", 1, 10**6)
    entropy_coefficient: float = option(0.0, "weight of the policy's entropy in its loss", 0, 1e6)
    policy_hidden: int = option(
        0, "units in the policy's hidden layer; 0: none, it is linear", 0, 2**16
    )
    log_std_init: float = option(
        -0.5,
        "continuous actions: logarithm of the first deviation, in halves of their range",
        -4,
        4,
    )
    value_hidden: int = option(32, "units in each of the baseline's two layers", 1, 2**16)
    normalize_observations: bool = option(
        False, "by mean and deviation as seen so far; for where no scale is known"
    )
    observation_scale: tuple[float, ...] = option(
        (), "what each number of an observation is divided by; none: 1"
    )

    save_every: int = option(
        100, "episodes between saves of the networks as .pth; 0: at the end only", 0, 2**31 - 1
    )

    def __post_init__(self) -> None:
        check_options(self)
        if not all(each > 0.0 for each in self.observation_scale):
            raise WorkbenchError(f"observation_scale is positive, not {self.observation_scale}")


@dataclass(frozen=True)
class DocumentSettings:
    """The options of the policy-gradient document's algorithm, which are constants in its script."""

    gamma: float = option(0.99, "discount of rewards, for each step that they come later", 0, 1)
    policy_learning_rate: float = option(0.01, "of the policy's Adam", 0, 10)
    value_learning_rate: float = option(0.1, "of the value network's Adam", 0, 10)
    random_weights: bool = option(
        False, "draw all initial weights at random, as the script does; else the output layers "
        "start at zero, which learns more reliably",
    )  # fmt: skip

    save_every: int = option(
        100, "episodes between saves of the networks as .pth; 0: at the end only", 0, 2**31 - 1
    )

    def __post_init__(self) -> None:
        check_options(self)
