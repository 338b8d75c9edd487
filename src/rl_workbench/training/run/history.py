"""What a training has seen so far, as its record and its checkpoints hold it."""

from dataclasses import dataclass, field
from typing import Any

import torch


@dataclass
class History:
    """Episodes, evaluations and wall time of a training."""

    returns: list[float] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)
    evaluations: list[tuple[int, float]] = field(default_factory=list)  # step, mean return
    best: tuple[int, float] | None = None  # of the evaluations
    seconds: float = 0.0  # of wall time until it was last resumed

    @property
    def steps(self) -> int:
        """Of all finished episodes."""
        return sum(self.lengths)

    def state_dict(self) -> dict[str, Any]:
        """Plain numbers and tensors."""
        return {
            "returns": torch.tensor(self.returns, dtype=torch.float64),
            "lengths": torch.tensor(self.lengths, dtype=torch.int64),
            "evaluations": [list(each) for each in self.evaluations],
            "best": None if self.best is None else list(self.best),
            "seconds": self.seconds,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Takes over what `state_dict` gave.

        Raises:
            TypeError, ValueError, LookupError, AttributeError: if it gave something else.
        """
        self.returns = [float(each) for each in state["returns"].tolist()]
        self.lengths = [int(each) for each in state["lengths"].tolist()]
        if len(self.returns) != len(self.lengths):
            raise ValueError(f"{len(self.returns)} returns, {len(self.lengths)} lengths")
        self.evaluations = [(int(step), float(mean)) for step, mean in state["evaluations"]]
        self.best = None
        if state["best"] is not None:
            step, mean = state["best"]
            self.best = (int(step), float(mean))
        self.seconds = float(state["seconds"])
