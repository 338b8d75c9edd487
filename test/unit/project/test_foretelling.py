"""benchmark/foretelling.py: what a simulation of a cluster's events comes to where that can be reckoned."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest


@pytest.fixture
def foretelling(root, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(root / "benchmark")
    import foretelling

    return foretelling


@pytest.fixture
def rolling(foretelling) -> Any:
    """A driver that costs nothing."""
    return foretelling.RolloutTimes(step=1e-3, episode=0.1, call=0.0, latency=0.0, learn_step=0.0)


def test_workers_that_cost_the_driver_nothing_add_up(foretelling, rolling) -> None:
    one = foretelling.rollouts(rolling, 1, [400])
    assert one.rate == pytest.approx(400 / 0.5)
    assert foretelling.rollouts(rolling, 64, [400]).rate == pytest.approx(64 * one.rate)
    assert one.busy == 0.0


def test_a_round_takes_as_long_as_its_longest_episode(foretelling, rolling) -> None:
    found = foretelling.rollouts(rolling, 200, [100, 900])
    assert found.seconds == pytest.approx(50 * 1.0)
    assert found.rate == pytest.approx(200 * 500, rel=0.05)


def test_the_parts_of_a_round_follow_each_other(foretelling, rolling) -> None:
    costly = replace(rolling, call=0.01, latency=0.002, learn_step=1e-4)
    # Two calls, the second one's episode, its answer, and what is learned from both.
    wanted = 0.01 + 0.002 + 0.5 + 0.005 + 2 * 400 * 1e-4
    assert foretelling.rollouts(costly, 2, [400]).seconds == pytest.approx(50 * wanted)


def test_a_driver_that_is_full_sets_the_pace(foretelling, rolling) -> None:
    costly = replace(rolling, call=0.01, learn_step=1e-4)
    found = foretelling.rollouts(costly, 512, [400])
    most = foretelling.most_steps(costly, [400])
    assert most == pytest.approx(400 / (0.01 + 0.04))
    assert 0.9 * most < found.rate <= most
    assert found.busy > 0.9


def test_jobs(foretelling) -> None:
    times = foretelling.JobTimes(job=9.0, begin=1.0, driver=0.0)
    assert foretelling.jobs(times, 1, 7).seconds == pytest.approx(70.0)
    assert foretelling.jobs(times, 3, 7).seconds == pytest.approx(30.0)
    full = replace(times, driver=0.1)
    assert foretelling.jobs(full, 1000, 5000).seconds == pytest.approx(500.0, rel=0.05)
    assert foretelling.jobs(full, 1000, 5000).busy > 0.95
