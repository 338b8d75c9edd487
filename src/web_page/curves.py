"""The curves of a training on a page: of a table that grows, in charts with a bounded number of points."""

import math
from html import escape
from pathlib import Path

import numpy as np
import viser
from viser import uplot

from web_page.series import WINDOW, Series
from web_page.table import GrowingTable, Look

EPISODES, LENGTHS, SPEED = "charts/episodic_return", "charts/episodic_length", "charts/SPS"
# What trainings write, in the order in which it is shown. Other losses are added as they come.
TITLES = {
    EPISODES: "return",
    "eval/mean_reward": "return of greedy episodes",
    "rollout/success_rate": "success rate of the last 100 episodes",
    "eval/success_rate": "success rate of greedy episodes",
    LENGTHS: "episode length [steps]",
    "charts/epsilon": "epsilon",
    SPEED: "steps/s",
}
OTHERS = "losses/"
SMOOTH = (EPISODES, LENGTHS)  # and losses
MOST_CHARTS = 16
HEIGHT = 150  # [pixels]
# Mantissas of the axes' ends. The axis of steps is given, and seldom another one: viser's own way of
# following data loses the range of a chart that is drawn while it can't be seen.
ENDS = (1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.4, 8.0, 10.0)
AXES = (uplot.Axis(space=85), uplot.Axis(size=55))  # [pixels] for 100,000,000 and for 100,000
PALE, STRONG, SINGLE = "rgba(76, 114, 176, 0.45)", "#c0392b", "#2a6f97"


Container = viser.GuiTabHandle | viser.GuiFolderHandle


class Curves:
    """Charts in a tab or folder.

    Args:
        gui: of the page.
        container: the tab or folder.
    """

    def __init__(self, gui: viser.GuiApi, container: Container) -> None:
        self._gui, self._container = gui, container
        self._table: GrowingTable | None = None
        with container:
            self._told = gui.add_html("")
        self._series: dict[str, Series] = {}
        self._charts: dict[str, viser.GuiUplotHandle] = {}
        self._ends: dict[str, float] = {}  # of the charts' axes of steps
        self._step = 0.0
        self._unseen: set[str] = set()  # tags that have more than their charts
        self._say("no training")

    def follow(self, place: Path) -> None:
        """Shows another table, or the table of another folder."""
        if self._table is None or self._table.place != place:
            self._table = GrowingTable(place)
            self._clear()

    def look(self) -> bool:
        """Draws what has come; returns whether there is more to read at once."""
        if self._table is None:
            return False
        look = self._table.look()
        if look.began_anew:
            self._clear()
        self._take(look)
        if not look.is_behind:  # else it would be drawn a hundred times until it is read
            self._draw()
        self._tell(look.problem)
        return look.is_behind

    def _clear(self) -> None:
        for chart in self._charts.values():
            chart.remove()
        self._charts, self._series, self._step = {}, {}, 0.0
        self._unseen = set()

    def _take(self, look: Look) -> None:
        for step, tag, value in look.points:
            series = self._series.get(tag)
            if series is None:
                if not self._is_shown(tag):
                    continue
                series = self._series[tag] = Series()
            series.add(step, value)
            self._step = step
            self._unseen.add(tag)

    def _is_shown(self, tag: str) -> bool:
        return tag in TITLES or (tag.startswith(OTHERS) and len(self._series) < MOST_CHARTS)

    def _draw(self) -> None:
        for tag in sorted(self._unseen):
            x, values, averages = self._series[tag].arrays()
            smooth = tag in SMOOTH or tag.startswith(OTHERS)
            data = (x, values, averages) if smooth else (x, values)
            if tag in self._charts:
                self._charts[tag].data = data
                if self._ends[tag] < x[-1]:
                    self._charts[tag].scales = self._scales(tag, x[-1])
            else:
                with self._container:
                    self._charts[tag] = self._chart(tag, data, smooth)
        self._unseen.clear()

    def _chart(self, tag: str, data: tuple[np.ndarray, ...], smooth: bool) -> viser.GuiUplotHandle:
        lines = [uplot.Series(label="step")]
        if smooth:
            lines.append(uplot.Series(label="each", stroke=PALE, width=1))
            lines.append(uplot.Series(label=f"mean of {WINDOW}", stroke=STRONG, width=2))
        else:
            lines.append(uplot.Series(label=tag, stroke=SINGLE, width=2))
        title = TITLES.get(tag, tag)
        names = list(TITLES)
        place = names.index(tag) if tag in names else len(names)
        return self._gui.add_uplot(
            data, tuple(lines), title=title, height=HEIGHT, order=self._order(place),
            legend=uplot.Legend(show=False), axes=AXES, scales=self._scales(tag, data[0][-1]),
        )  # fmt: skip

    def _scales(self, tag: str, last: float) -> dict[str, uplot.Scale]:
        """An axis from 0 to somewhat beyond the last step."""
        tens = 10.0 ** math.floor(math.log10(max(last, 1.0)))
        self._ends[tag] = next(each * tens for each in ENDS if each * tens >= last)
        return {"x": uplot.Scale(time=False, auto=False, range=(0.0, self._ends[tag]))}

    def _order(self, place: int) -> float:
        return float(self._told.order) + 0.001 * (1 + place)

    def _tell(self, problem: str) -> None:
        words = []
        if EPISODES in self._series:
            series = self._series[EPISODES]
            words.append(f"{series.count} episodes, {self._step:.0f} steps")
            words.append(f"return {series.average:.1f} (mean of {WINDOW})")
        if problem:
            words.append(problem)
        self._say(escape(", ".join(words)) or "no episode has ended yet")

    def _say(self, text: str) -> None:
        content = f'<div style="padding: 0.4em 0.8em">{text}</div>'
        if content != self._told.content:
            self._told.content = content
