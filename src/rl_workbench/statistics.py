"""Scores of several seeds as figures: mean, deviation, median, interquartile mean, intervals."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

CONFIDENCE = 0.95
RESAMPLES = 10_000
CUT = 0.25  # of either end, for the interquartile mean
Statistic = Callable[..., np.ndarray]  # of an array along `axis`


class Statistics(NamedTuple):
    """Of n scores; an interval needs two of them."""

    n: int
    mean: float
    std: float  # of the seeds, n - 1
    median: float
    iqm: float
    mean_interval: tuple[float, float] | None
    iqm_interval: tuple[float, float] | None


def iqm(scores: np.ndarray, axis: int = -1) -> np.ndarray:
    """The mean of the middle half: neither a lucky nor a failed seed decides it alone."""
    from scipy import stats  # takes a second, which no training has to wait for

    return np.asarray(stats.trim_mean(scores, CUT, axis=axis))


def describe(scores: np.ndarray) -> Statistics:
    """All figures of scores (N,), N at least 1; intervals by percentile bootstrap over them."""
    several = len(scores) > 1
    return Statistics(
        len(scores),
        float(np.mean(scores)),
        float(np.std(scores, ddof=1)) if several else 0.0,
        float(np.median(scores)),
        float(iqm(scores)),
        interval(scores, np.mean) if several else None,
        interval(scores, iqm) if several else None,
    )


def interval(scores: np.ndarray, statistic: Statistic) -> tuple[float, float]:
    """The bootstrap interval of a statistic over scores (N,); always the same for the same."""
    low, high = bands(scores[:, None], statistic, RESAMPLES)
    return float(low[0]), float(high[0])


def bands(
    scores: np.ndarray, statistic: Statistic, resamples: int = 1_000
) -> tuple[np.ndarray, np.ndarray]:
    """Percentile bootstrap intervals over the first axis of (N, P): two arrays (P,)."""
    from scipy import stats

    found = stats.bootstrap(
        (scores,),
        statistic,
        axis=0,
        n_resamples=resamples,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return np.asarray(found.low), np.asarray(found.high)
