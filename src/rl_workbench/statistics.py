"""Statistics of several seeds' scores: mean, deviation, median, interquartile mean, intervals."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

CONFIDENCE = 0.95
RESAMPLES = 10_000
CUT = 0.25  # of either end, for the interquartile mean
Statistic = Callable[..., np.ndarray]  # of an array along `axis`


class Statistics(NamedTuple):
    """Statistics of n scores."""

    n: int
    mean: float
    std: float  # with n - 1 degrees of freedom
    median: float
    iqm: float
    iqm_interval: tuple[float, float] | None  # None for a single score


def iqm(scores: np.ndarray, axis: int = -1) -> np.ndarray:
    """Returns the interquartile mean, which a single outlier hardly changes."""
    count = scores.shape[axis]
    cut = int(CUT * count)
    return np.mean(np.sort(scores, axis).take(range(cut, count - cut), axis), axis)


def describe(scores: np.ndarray) -> Statistics:
    """Returns all statistics of scores (N,), N at least 1; intervals by percentile bootstrap."""
    several = len(scores) > 1
    return Statistics(
        len(scores),
        float(np.mean(scores)),
        float(np.std(scores, ddof=1)) if several else 0.0,
        float(np.median(scores)),
        float(iqm(scores)),
        interval(scores, iqm) if several else None,
    )


def interval(scores: np.ndarray, statistic: Statistic) -> tuple[float, float]:
    """Returns the bootstrap interval of a statistic over scores (N,); the same scores give the same."""
    low, high = bands(scores[:, None], statistic, RESAMPLES)
    return float(low[0]), float(high[0])


def bands(scores: np.ndarray, statistic: Statistic, resamples: int = 1_000) -> tuple[np.ndarray, np.ndarray]:
    """Returns percentile bootstrap intervals over the first axis of (N, P), as two arrays (P,)."""
    count = len(scores)
    picked = np.random.default_rng(0).integers(count, size=(resamples, count))
    results = statistic(scores.T[:, picked], axis=-1)
    low, high = np.quantile(results, [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0], axis=-1)
    return low, high
