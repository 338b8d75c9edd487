"""A pool of players in this process, which may lose some of them, and has them play in any order."""

import pickle
from collections.abc import Callable, Sequence
from typing import Any

from rl_workbench.training.options.training_options import TrainingOptions
from rl_workbench.training.rollouts.worker import Failure, Home, Worker
from rl_workbench.training.run.random_states import random_states, restore_random_states


class PoolHere:
    """What a cluster's workers do, without a cluster.

    Args:
        options: of the training.
        backwards: whether the last one plays first.
        lost: in which rounds all players are lost before they play, counted from 0 on.
    """

    def __init__(
        self,
        options: TrainingOptions,
        backwards: bool = False,
        lost: Callable[[int], bool] = lambda rounds: False,
    ) -> None:
        self._record, self._lost = options.record(), lost
        self._order = range(options.run.num_envs)[:: -1 if backwards else 1]
        self._home = Home([], pickle.dumps([]))
        self._workers: dict[int, Worker] = {}
        self._rounds = 0

    def play(
        self, policy: Any, states: Sequence[Any], should_stop: Callable[[], bool]
    ) -> list[Any] | None:
        if self._lost(self._rounds):
            self._workers.clear()
        own, found = random_states(), {}
        for index in self._order:
            if should_stop():
                restore_random_states(own)
                return None
            worker = self._workers.setdefault(index, Worker(self._record, index, self._home))
            found[index] = worker.play(policy, states[index])
            assert not isinstance(found[index], Failure), found[index].trace
        restore_random_states(own)  # each has a process of its own on a cluster
        self._rounds += 1
        return [found[index] for index in range(len(states))]

    def close(self) -> None:
        for worker in self._workers.values():
            worker.close()
