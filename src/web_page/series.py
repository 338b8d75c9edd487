"""A curve of any length in a bounded number of points."""

from collections import deque
from typing import NamedTuple

import numpy as np

WINDOW = 20  # values of the moving average, as in the pictures that `plot` draws
MOST = 300  # buckets: a chart is as many pixels wide


class _Bucket(NamedTuple):
    """Values that follow each other, as one: from where to where, the first and the last of their extremes,
    and the moving average at their end."""

    begin: float
    end: float
    first: float
    last: float
    average: float


class Series:
    """Values over steps, and their moving average over the last WINDOW of them.

    Beyond MOST values, several become a bucket that is drawn by its least and its greatest value. The average
    is that of the single values.
    """

    def __init__(self) -> None:
        self._recent: deque[float] = deque(maxlen=WINDOW)
        self._closed: list[_Bucket] = []
        self._size = 1  # values of a bucket
        self._open: list[tuple[float, float]] = []  # x and value, of the one that isn't full
        self.count = 0

    def add(self, x: float, value: float) -> None:
        """Takes the next value; x doesn't fall."""
        self.count += 1
        self._recent.append(value)
        self._open.append((x, value))
        if len(self._open) == self._size:
            self._closed.append(self._bucket())
            self._open = []
            if len(self._closed) == 2 * MOST:
                pairs = zip(self._closed[::2], self._closed[1::2], strict=True)
                self._closed = [_joined(first, second) for first, second in pairs]
                self._size *= 2

    @property
    def average(self) -> float:
        """The moving average at the end."""
        return sum(self._recent) / len(self._recent)

    def _bucket(self) -> _Bucket:
        first, last = _extremes([value for _, value in self._open])
        return _Bucket(self._open[0][0], self._open[-1][0], first, last, self.average)

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns x, values and averages, each (N,) with N of at most 4 * MOST."""
        buckets = [*self._closed, *([self._bucket()] if self._open else [])]
        if self._size == 1:
            rows = [(each.end, each.last, each.average) for each in buckets]
        else:
            rows = []
            before = buckets[0].average
            for each in buckets:
                rows += [(each.begin, each.first, before), (each.end, each.last, each.average)]
                before = each.average
        table = np.array(rows, dtype=np.float64).reshape(-1, 3)
        return table[:, 0].copy(), table[:, 1].copy(), table[:, 2].copy()


def _joined(one: _Bucket, next_one: _Bucket) -> _Bucket:
    first, last = _extremes([one.first, one.last, next_one.first, next_one.last])
    return _Bucket(one.begin, next_one.end, first, last, next_one.average)


def _extremes(values: list[float]) -> tuple[float, float]:
    """The least and the greatest value, in the order in which they came."""
    low, high = min(values), max(values)
    return (low, high) if values.index(low) <= values.index(high) else (high, low)
