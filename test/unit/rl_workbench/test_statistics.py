"""Figures over seeds against slow and obvious ones."""

import numpy as np
import pytest

from rl_workbench.statistics import describe, interval, iqm


def test_the_interquartile_mean_drops_a_quarter_at_either_end() -> None:
    assert iqm(np.array([0.0, 10.0, 20.0, 500.0])) == 15.0
    assert iqm(np.array([1.0, 2.0])) == 1.5
    scores = np.arange(20.0)
    assert iqm(scores) == np.mean(sorted(scores)[5:15])


def test_all_figures() -> None:
    found = describe(np.array([1.0, 2.0, 3.0, 4.0, 90.0]))
    assert found.n == 5 and found.mean == 20.0 and found.median == 3.0
    assert found.std == pytest.approx(np.std([1, 2, 3, 4, 90], ddof=1))
    assert found.iqm == 3.0
    low, high = found.iqm_interval
    assert 1.0 <= low < found.iqm < high <= 90.0


def test_the_interval_is_that_of_a_bootstrap() -> None:
    scores = np.random.default_rng(1).normal(100.0, 15.0, 30)
    rng = np.random.default_rng(2)
    means = [rng.choice(scores, len(scores)).mean() for _ in range(10_000)]
    assert interval(scores, np.mean) == pytest.approx(np.percentile(means, [2.5, 97.5]), abs=0.4)


@pytest.mark.filterwarnings("error")
def test_equal_scores_have_an_interval_of_no_width() -> None:
    found = describe(np.full(10, 500.0))
    assert found.iqm_interval == (500.0, 500.0)


def test_one_score_has_none() -> None:
    found = describe(np.array([7.0]))
    assert found.iqm_interval is None and found.std == 0.0 and found.iqm == 7.0
