"""What a cluster would do, by simulating its events one after the other with measured times.

A driver does one thing at a time: sends calls, takes answers, learns. Workers play or train, each on a core
of its own. Nothing else is in the way: no network that is full, no core that somebody else needs.
"""

import heapq
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True)
class RolloutTimes:
    """Of policy gradient by episodes that workers play; each in [s]."""

    step: float  # of a worker, with its environment and the policy's choice
    episode: float  # of a worker, for an episode beside its steps
    call: float  # of the driver, for a call and its answer
    latency: float  # there and back, beside the driver's own part
    learn_step: float  # of the driver, for each step that is learned from


@dataclass(frozen=True)
class JobTimes:
    """Of trainings that don't know of each other; each in [s]."""

    job: float  # one, from its process's begin to its end, alone on a core
    begin: float  # of a node, until a job's process begins
    driver: float  # of the driver, for a job


class Foretold(NamedTuple):
    """What comes of it."""

    rate: float  # steps or jobs [1/s]
    seconds: float  # in all
    busy: float  # the part of the time in which the driver was at work


class _Driver:
    """Does one thing after the other."""

    def __init__(self) -> None:
        self.now = self.busy = 0.0

    def does(self, since: float, seconds: float) -> float:
        """Begins at `since`, or later where it isn't free; returns when that is done."""
        self.now = max(self.now, since) + seconds
        self.busy += seconds
        return self.now

    def foretold(self, count: int) -> Foretold:
        return Foretold(count / self.now, self.now, self.busy / self.now)


def rollouts(
    times: RolloutTimes, workers: int, lengths: Sequence[int], rounds: int = 50
) -> Foretold:
    """Rounds, in each of which every worker plays an episode by the same weights; then all are learned from.

    A round takes as long as its longest episode, so the more workers there are, the longer.

    Args:
        lengths: of episodes [steps], each drawn from these.
    """
    driver, draws, steps = _Driver(), random.Random(0), 0
    for _ in range(rounds):
        answers: list[float] = []
        played = draws.choices(lengths, k=workers)
        for length in played:
            sent = driver.does(driver.now, times.call / 2)
            heapq.heappush(answers, sent + times.latency + times.episode + length * times.step)
        while answers:
            driver.does(heapq.heappop(answers), times.call / 2)
        driver.does(driver.now, sum(played) * times.learn_step)
        steps += sum(played)
    return driver.foretold(steps)


def most_steps(times: RolloutTimes, lengths: Sequence[int]) -> float:
    """Steps [1/s] that the driver can take in and learn from, however many workers there are."""
    mean = sum(lengths) / len(lengths)
    return mean / (times.call + mean * times.learn_step)


def jobs(times: JobTimes, workers: int, count: int) -> Foretold:
    """As many jobs at a time as there are workers."""
    driver, ends = _Driver(), list[float]()
    waiting = count
    while waiting or ends:
        if waiting and len(ends) < workers:
            waiting -= 1
            begun = driver.does(driver.now, times.driver / 2)
            heapq.heappush(ends, begun + times.begin + times.job)
        else:
            driver.does(heapq.heappop(ends), times.driver / 2)
    return driver.foretold(count)
