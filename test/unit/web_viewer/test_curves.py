"""Curves of any length in a bounded number of points."""

import random

import numpy as np
import pytest

from rl_workbench.plotting import moving_average
from web_viewer.curves import MAX_BUCKETS, Series, _title


def filled(values):
    series = Series()
    for x, value in enumerate(values):
        series.add(float(x), value)
    return series


@pytest.mark.parametrize("count", [1, 2, 19, 20, 21, 2 * MAX_BUCKETS - 1])
def test_short_ones_are_drawn_point_by_point_and_averaged_as_plot_does(count):
    values = [random.Random(count).uniform(-5, 500) for _ in range(count)]
    x, each, average = filled(values).arrays()
    assert x.tolist() == list(range(count))
    assert each.tolist() == values
    np.testing.assert_allclose(average, moving_average(values))


@pytest.mark.parametrize("count", [2 * MAX_BUCKETS, 5_000, 77_777])
def test_long_ones_keep_their_extremes_and_their_end(count):
    draw = random.Random(count)
    values = [draw.gauss(100, 10) for _ in range(count)]
    values[count // 3], values[-2] = 1e4, -1e4
    x, each, average = filled(values).arrays()
    assert len(x) == len(each) == len(average) <= 2 * MAX_BUCKETS
    assert x[0] == 0
    assert x[-1] == count - 1
    assert (np.diff(x) >= 0).all()
    assert each.max() == 1e4
    assert each.min() == -1e4
    # The peak is drawn where it was.
    assert abs(x[each.argmax()] - count // 3) <= count / MAX_BUCKETS
    smooth = moving_average(values)
    assert average[-1] == pytest.approx(smooth[-1])
    assert set(np.round(average, 6)) <= set(np.round(smooth, 6))


def test_the_extremes_come_in_their_order():
    count = 4 * MAX_BUCKETS
    _, each, _ = filled([float(index) for index in range(count)]).arrays()
    assert (np.diff(each) > 0).all()
    _, each, _ = filled([float(-index) for index in range(count)]).arrays()
    assert (np.diff(each) < 0).all()


@pytest.mark.parametrize(
    ("tag", "values", "title", "unit"),
    [
        ("charts/episodic_return", [-9999.0, 20.0], "return", 1.0),
        ("charts/episodic_return", [0.0], "return", 1.0),
        ("charts/episodic_return", [-1234567.0, 3.0], "return, in 10⁶", 1e6),
        ("losses/value", [2e-5, 0.0], "losses/value, in 10⁻⁶", 1e-6),
        ("losses/value", [5e-324], "losses/value, in 10⁻³⁰⁰", 1e-300),
        ("losses/value", [1.7e308], "losses/value, in 10³⁰⁶", 1e306),
        ("losses/" + 90 * "x" + "_end", [1.0], "losses/xxxxxxxxxxxxx…xxxxxxxxxxxxxxxx_end", 1.0),
    ],
)
def test_what_would_be_cut_off_beside_a_chart_is_shortened(tag, values, title, unit):
    found, divisor = _title(tag, np.array(values))
    assert found == title and divisor == pytest.approx(unit)
