"""What a training has seen so far, as its record and its checkpoints hold it."""

import math
from dataclasses import dataclass, field
from typing import Any

import torch

from rl_workbench.states import array, number, sequence, whole
from rl_workbench.training.options.run_options import RunOptions

WINDOW = 20  # [episodes] over which a mean length counts
LAST = 100  # [episodes] over which successes and the summary's mean return count


@dataclass
class History:
    """Episodes, evaluations and wall time of a training."""

    returns: list[float] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)
    successes: list[bool] = field(
        default_factory=list
    )  # of the episodes that say whether they are one
    evaluations: list[tuple[int, float]] = field(default_factory=list)  # step, mean return
    best: tuple[int, float] | None = None  # of the evaluations
    seconds: float = 0.0  # of wall time until it was last resumed

    @property
    def steps(self) -> int:
        """Of all finished episodes."""
        return sum(self.lengths)

    @property
    def best_return(self) -> float:
        """The mean return of the best evaluation; minus infinity before the first."""
        return self.best[1] if self.best else -math.inf

    @property
    def success_rate(self) -> float:
        """Of the last 100 episodes that say it; there is one at least."""
        recent = self.successes[-LAST:]
        return sum(recent) / len(recent)

    def was_evaluated(self, steps: int) -> bool:
        """Whether the last evaluation was at this step."""
        return bool(self.evaluations) and self.evaluations[-1][0] == steps

    def is_complete(self, run: RunOptions, steps: int) -> bool:
        """Whether what the user asked for is reached.

        Args:
            run: what they asked for.
            steps: done so far, those of an unfinished episode included.
        """
        recent = self.lengths[-WINDOW:]
        return (
            bool(run.total_timesteps and steps >= run.total_timesteps)
            or bool(run.episodes and len(self.returns) >= run.episodes)
            or (run.stop_at_return is not None and self.best_return >= run.stop_at_return)
            or (
                bool(run.stop_at_length)
                and len(recent) == WINDOW
                and sum(recent) >= run.stop_at_length * WINDOW
            )
        )

    def state_dict(self) -> dict[str, Any]:
        """Plain numbers and tensors."""
        return {
            "returns": torch.tensor(self.returns, dtype=torch.float64),
            "lengths": torch.tensor(self.lengths, dtype=torch.int64),
            "successes": torch.tensor(self.successes, dtype=torch.bool),
            "evaluations": [list(each) for each in self.evaluations],
            "best": None if self.best is None else list(self.best),
            "seconds": self.seconds,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Takes over what `state_dict` gave.

        Raises:
            TypeError, ValueError, LookupError: if it gave something else.
        """
        self.returns = array(state["returns"], torch.float64, (None,)).tolist()
        lengths = array(state["lengths"], torch.int64, (len(self.returns),))
        self.lengths = [whole(each) for each in lengths.tolist()]
        if "successes" in state:  # earlier versions didn't count them
            self.successes = array(state["successes"], torch.bool, (None,)).tolist()
        self.evaluations = [evaluation_of(each) for each in sequence(state["evaluations"])]
        self.best = None if state["best"] is None else evaluation_of(state["best"])
        self.seconds = number(state["seconds"])
        if self.seconds < 0:
            raise ValueError(f"{self.seconds} s of wall time")


def evaluation_of(state: Any) -> tuple[int, float]:
    """Step and mean return, from a checkpoint.

    Raises:
        ValueError: if it holds something else.
    """
    step, mean = sequence(state, 2)
    return whole(step), number(mean)
