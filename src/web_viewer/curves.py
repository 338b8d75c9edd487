"""The curves of a training on a page: charts with a bounded number of points over a table that grows."""

import math
from array import array
from collections import deque
from html import escape
from pathlib import Path

import numpy as np
import viser
from viser import uplot

from web_viewer.table import GrowingTable, TableUpdate

EPISODES, LENGTHS, SPEED = "charts/episodic_return", "charts/episodic_length", "charts/SPS"
# The tags of trainings, in the order of the charts; those that begin as EXTRA follow as they come.
TITLES = {
    EPISODES: "return",
    "eval/mean_reward": "return of greedy episodes",
    "rollout/success_rate": "success rate of the last 100 episodes",
    "eval/success_rate": "success rate of greedy episodes",
    LENGTHS: "episode length [steps]",
    "charts/epsilon": "epsilon",
    SPEED: "steps/s",
}
EXTRA = ("losses/", "info/")
SMOOTHED = (EPISODES, LENGTHS)  # and what begins as EXTRA
MAX_CHARTS = 16
HEIGHT = 150  # [pixels]
# Mantissas of the axes' ends. We set the range of steps ourselves, and seldom: when viser fits it to the
# data, a chart that is drawn while it is hidden loses its range.
ENDS = (1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.4, 8.0, 10.0)
AXES = (uplot.Axis(space=85), uplot.Axis(size=55))  # [pixels] for 100,000,000 and for -9,999.9
PADDING = (8, 36, 0, 0)  # [pixels] above, and to the right for half of the last step
SMALLEST, LARGEST = 0.01, 10_000.0  # values that are written out
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MOST_LETTERS = 40  # of a title
PALE, STRONG, SINGLE = "rgba(76, 114, 176, 0.45)", "#c0392b", "#2a6f97"
WINDOW = 20  # values of the moving average, as in the pictures that `plot` draws
MAX_BUCKETS = 300  # a chart is about as many pixels wide

Container = viser.GuiTabHandle | viser.GuiFolderHandle


class Curves:
    """Charts in a tab or a folder of a page."""

    def __init__(self, gui: viser.GuiApi, container: Container) -> None:
        self._gui, self._container = gui, container
        self._table: GrowingTable | None = None
        with container:
            self._summary = gui.add_html("")
        self._series: dict[str, Series] = {}
        self._charts: dict[str, viser.GuiUplotHandle] = {}
        self._ends: dict[str, float] = {}  # of the charts' axes of steps
        self._step = 0.0
        self._changed: set[str] = set()  # tags with points that aren't drawn yet
        self._summarise("no training")

    def follow(self, path: Path) -> None:
        """Follows another table, named by its file or folder."""
        if self._table is None or self._table.path != path:
            self._table = GrowingTable(path)
            self._clear()

    def update(self) -> bool:
        """Draws new points; returns whether there are more to read at once."""
        if self._table is None:
            return False
        update = self._table.read()
        if update.restarted:
            self._clear()
        self._take(update)
        if not update.has_more:  # else a long table would be drawn a hundred times while it is read
            self._draw()
        self._describe(update.problem)
        return update.has_more

    def _clear(self) -> None:
        for chart in self._charts.values():
            chart.remove()
        self._charts, self._series, self._step = {}, {}, 0.0
        self._changed = set()

    def _take(self, update: TableUpdate) -> None:
        for step, tag, value in update.points:
            series = self._series.get(tag)
            if series is None:
                is_extra = tag.startswith(EXTRA) and len(self._series) < MAX_CHARTS
                if tag not in TITLES and not is_extra:
                    continue
                series = self._series[tag] = Series()
            series.add(step, value)
            self._step = step
            self._changed.add(tag)

    def _draw(self) -> None:
        for tag in sorted(self._changed):
            x, values, averages = self._series[tag].arrays()
            title, unit = _title(tag, values)
            values, averages = values / unit, averages / unit
            smooth = tag in SMOOTHED or tag.startswith(EXTRA)
            data = (x, values, averages) if smooth else (x, values)
            if tag in self._charts:
                self._charts[tag].data, self._charts[tag].title = data, title
                if self._ends[tag] < x[-1]:
                    self._charts[tag].scales = self._scales(tag, x[-1])
            else:
                with self._container:
                    self._charts[tag] = self._add_chart(tag, title, data)
        self._changed.clear()

    def _add_chart(
        self, tag: str, title: str, data: tuple[np.ndarray, ...]
    ) -> viser.GuiUplotHandle:
        lines = [uplot.Series(label="step")]
        if len(data) == 3:
            lines.append(uplot.Series(label="each", stroke=PALE, width=1))
            lines.append(uplot.Series(label=f"mean of {WINDOW}", stroke=STRONG, width=2))
        else:
            lines.append(uplot.Series(label=tag, stroke=SINGLE, width=2))
        names = list(TITLES)
        index = names.index(tag) if tag in names else len(names)
        return self._gui.add_uplot(
            data, tuple(lines), title=title, height=HEIGHT, padding=PADDING,
            order=float(self._summary.order) + 0.001 * (1 + index),
            legend=uplot.Legend(show=False), axes=AXES, scales=self._scales(tag, data[0][-1]),
        )  # fmt: skip

    def _scales(self, tag: str, last: float) -> dict[str, uplot.Scale]:
        """Returns an axis from 0 to somewhat beyond the last step."""
        tens = 10.0 ** math.floor(math.log10(max(last, 1.0)))
        self._ends[tag] = next(each * tens for each in ENDS if each * tens >= last)
        return {"x": uplot.Scale(time=False, auto=False, range=(0.0, self._ends[tag]))}

    def _describe(self, problem: str) -> None:
        parts = []
        if EPISODES in self._series:
            series = self._series[EPISODES]
            parts.append(f"{series.count} episodes, {self._step:.0f} steps")
            parts.append(f"return {series.average:.1f} (mean of {WINDOW})")
        if problem:
            parts.append(problem)
        self._summarise(escape(", ".join(parts)) or "no episode has ended yet")

    def _summarise(self, text: str) -> None:
        content = f'<div style="padding: 0.4em 0.8em">{text}</div>'
        if content != self._summary.content:
            self._summary.content = content


def _title(tag: str, values: np.ndarray) -> tuple[str, float]:
    """Returns a chart's title, and the unit in which its axis has few digits."""
    size = float(np.abs(values).max())
    title = TITLES.get(tag, tag)
    power = 0
    if size and not SMALLEST <= size < LARGEST:
        power = max(3 * math.floor(math.log10(size) / 3.0), -300)
        title = f"{title}, in 10{str(power).translate(RAISED)}"
    half = MOST_LETTERS // 2
    return title if len(title) <= MOST_LETTERS else f"{title[:half]}…{title[-half:]}", 10.0**power


class Series:
    """Values over steps, with their moving average over the last WINDOW of them.

    Beyond 2 * MAX_BUCKETS values, neighbours share a bucket, which is drawn by its least and its greatest
    value. The average is that of the single values.
    """

    def __init__(self) -> None:
        self._recent: deque[float] = deque(maxlen=WINDOW)
        self._rows = array("d")  # x, value and average, one after the other

    @property
    def count(self) -> int:
        """The number of values."""
        return len(self._rows) // 3

    def add(self, x: float, value: float) -> None:
        """Appends a value; x must not fall."""
        self._recent.append(value)
        self._rows.extend((x, value, self.average))

    @property
    def average(self) -> float:
        """The moving average at the end."""
        return sum(self._recent) / len(self._recent)

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns x, values and averages, each (N,) with N of at most 2 * MAX_BUCKETS."""
        table = np.array(self._rows).reshape(-1, 3)
        if len(table) > 2 * MAX_BUCKETS:
            table = np.concatenate([_ends(each) for each in np.array_split(table, MAX_BUCKETS)])
        x, values, averages = table.T.copy()
        return x, values, averages


def _ends(bucket: np.ndarray) -> np.ndarray:
    """Returns the first and the last row (2, 3), with the extreme values in the order in which they came."""
    ends = bucket[[0, -1]]
    ends[:, 1] = bucket[sorted((bucket[:, 1].argmin(), bucket[:, 1].argmax())), 1]
    return ends
