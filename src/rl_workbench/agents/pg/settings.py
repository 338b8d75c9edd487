"""All that the policy gradients can be told, each option with its default."""

from dataclasses import dataclass

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import check_options, option


@dataclass(frozen=True)
class ReinforceSettings:
    """The options of the algorithm.

    Raises:
        WorkbenchError: if a value is beyond its limits; names the option and these.
    """

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

    def __post_init__(self) -> None:
        check_options(self)
        if not all(each > 0.0 for each in self.observation_scale):
            raise WorkbenchError(f"observation_scale is positive, not {self.observation_scale}")


@dataclass(frozen=True)
class DocumentSettings:
    """The options of the ROS policy-gradient document's algorithm; its script has them as constants.

    Raises:
        WorkbenchError: if a value is beyond its limits; names the option and these.
    """

    gamma: float = option(0.99, "discount of rewards, for each step that they come later", 0, 1)
    policy_learning_rate: float = option(0.01, "of the policy's Adam", 0, 10)
    value_learning_rate: float = option(0.1, "of the value network's Adam", 0, 10)
    random_weights: bool = option(
        False, "draw all initial weights at random, as the script does; else the output layers "
        "start at zero, which learns more reliably",
    )  # fmt: skip

    def __post_init__(self) -> None:
        check_options(self)
