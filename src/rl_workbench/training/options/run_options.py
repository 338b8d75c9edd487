"""What every training can be told, whatever its algorithm."""

from dataclasses import dataclass
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import check_options, option
from rl_workbench.training.options.record import is_plain

LARGEST = 2**53


@dataclass(frozen=True)
class RunOptions:
    """One training around its algorithm: where, how long, and what it leaves behind.

    All frequencies count steps of the environment.

    Raises:
        WorkbenchError: if a value is beyond its limits.
    """

    env_id: str = option("CartPole-v1", "Gymnasium's id of the environment")
    env_kwargs: dict[str, Any] = option({}, "options of the environment, KEY=VALUE with commas")
    train_env_kwargs: dict[str, Any] = option(
        {}, "on top of env_kwargs, while it is trained: where, or how it starts"
    )
    eval_env_kwargs: dict[str, Any] = option({}, "on top of these, in evaluations")
    seed: int = option(0, "of weights, exploration, environment, evaluation", 0, 2**31 - 1)
    num_envs: int = option(1, "environments that it learns in at the same time", 1, 1024)
    total_timesteps: int = option(0, "the training's length [steps]; 0: any", 0, LARGEST)
    episodes: int = option(
        0, "the training's length in episodes, if that comes first; 0: any", 0, LARGEST
    )
    stop_at_return: float | None = option(
        None, "ends the training when a confirmed mean return reaches it", -1e18, 1e18
    )
    stop_at_length: float = option(
        0.0, "ends it when the last 20 episodes lasted X steps on average; 0: never", 0, 1e9
    )
    device: str = option("cpu", "torch's, as in cpu or cuda")
    exp_name: str = option("", "in the run folder's name (the algorithm's)")
    run_dir: str = option("", "a new or empty folder for all results (runs/ENV__EXP__SEED__TIME)")
    eval_frequency: int = option(
        10_000, "steps between two evaluations; 0: at the end only", 0, LARGEST
    )
    eval_episodes: int = option(10, "greedy episodes of an evaluation", 1, 10**6)
    confirm_episodes: int = option(
        0, "greedy episodes that a policy needs to become the best one; 0: those of the evaluation",
        0, 10**6,
    )  # fmt: skip
    checkpoint_frequency: int = option(
        10_000, "steps between two checkpoints; 0: at start and end only", 0, LARGEST
    )
    keep_checkpoints: int = option(3, "the newest ones are kept; 0: all", 0, 10**6)
    log_frequency: int = option(500, "steps between two points of losses/", 1, LARGEST)

    def __post_init__(self) -> None:
        check_options(self)
        if not self.env_id:
            raise WorkbenchError("env_id names an environment")
        if not self.total_timesteps and not self.episodes:
            raise WorkbenchError("a training has an end: total_timesteps, episodes, or both")
        for name in ("env_kwargs", "train_env_kwargs", "eval_env_kwargs"):
            if not is_plain(getattr(self, name)):
                raise WorkbenchError(
                    f"{name} has values that no file can hold: {getattr(self, name)}; texts, "
                    "finite numbers, true, false, lists and mappings of these will do"
                )

    @property
    def training_environment(self) -> dict[str, Any]:
        """The options of the environment that is learned in."""
        return self.env_kwargs | self.train_env_kwargs

    @property
    def evaluation_environment(self) -> dict[str, Any]:
        """And of the one in which the policy is evaluated meanwhile."""
        return self.training_environment | self.eval_env_kwargs
