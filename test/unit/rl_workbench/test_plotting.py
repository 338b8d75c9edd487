"""Learning curves say what happened: looked up in the lines that the axes hold."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from rl_workbench import plotting
from rl_workbench.plotting import Panel, SeedCurve, evaluation_curves, seed_curves, training_curves


def seed(positions: list[float], values: list[float], complete: bool = True) -> SeedCurve:
    return SeedCurve(np.array(positions, float), np.array(values, float), complete)


def panel(curves: dict[str, list[SeedCurve]], title: str = "Some-v0", line: float | None = None):
    return Panel(title, curves, line)


def lines(axes: Axes, kind: str) -> list[Line2D]:
    return [each for each in axes.lines if each.get_gid() == kind]


def the_mean(axes: Axes) -> Line2D:
    (found,) = lines(axes, "mean")
    return found


def at(line: Line2D, position: float) -> float:
    return float(np.interp(position, line.get_xdata(), line.get_ydata()))


@pytest.mark.parametrize("count", [1, 300])
def test_one_training_has_two_axes_and_can_be_written_as_png(tmp_path: Path, count: int) -> None:
    lengths = np.random.default_rng(0).integers(1, 3000, count).tolist()
    figure = plotting.learning_curve(lengths, [length / 2 for length in lengths], "title")
    upper, lower = figure.axes
    drawn = [line.get_ydata().tolist() for line in upper.lines]
    assert drawn == [lengths, plotting.moving_average(lengths).tolist()]
    assert lower.lines[0].get_ydata().tolist() == [length / 2 for length in lengths]
    with (tmp_path / "curve.png").open("wb") as file:
        plotting.as_png(figure)(file)
    assert (tmp_path / "curve.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_a_seed_that_has_ended_keeps_its_last_value_in_the_mean() -> None:
    solved, slow = seed([100, 200], [100, 500]), seed([100, 1000], [100, 100])
    positions, mean, _, _ = plotting.mean_over_seeds([solved, slow])
    assert (positions[0], positions[-1]) == (100, 1000)
    assert np.interp([200, 600, 1000], positions, mean) == pytest.approx([300, 300, 300])


def test_the_band_lies_around_the_mean_and_one_seed_has_none() -> None:
    curves = [seed([1, 2], [value, 2 * value]) for value in (1.0, 2.0, 6.0)]
    _, mean, low, high = plotting.mean_over_seeds(curves)
    assert (low < mean).all() and (mean < high).all()
    (axes,) = seed_curves([panel({"dqn": curves[:1]})]).axes
    assert not axes.collections and not lines(axes, "seed"), "the thick line is the seed itself"


def test_where_seeds_ended_is_marked_and_whether_they_were_complete() -> None:
    curves = [seed([1, 5], [0, 7]), seed([1, 9], [0, 3], complete=False), seed([1, 4], [0, 8])]
    (axes,) = evaluation_curves([panel({"dqn": curves})]).axes
    (ended,), (stopped,) = lines(axes, "ended"), lines(axes, "stopped")
    assert ended.get_marker() != stopped.get_marker()
    assert ended.get_xydata().tolist() == [[5, 7], [4, 8]]
    assert stopped.get_xydata().tolist() == [[9, 3]]


def test_each_environment_has_axes_and_a_line_of_its_own() -> None:
    cart, car = seed([1, 2], [450, 520]), seed([1, 2], [-110, -100])
    first = panel({"dqn": [cart]}, "my_module:CartPole-v1", 475.0)
    panels = [first, panel({"dqn": [car], "ppo": [car]}, "MountainCar-v0", -110.0)]
    for figure in (seed_curves(panels), training_curves(panels, "episode")):
        assert figure.get_figwidth() <= 10.0, "it is read on a page of half its pixels"
        first, second = figure.axes
        assert [axes.get_title() for axes in figure.axes] == ["CartPole-v1", "MountainCar-v0"]
        for axes, line in ((first, 475.0), (second, -110.0)):
            (drawn,) = lines(axes, "threshold")
            assert set(drawn.get_ydata()) == {line}
            assert drawn.get_label() == f"solved ({line:g}), without exploration"
        assert first.get_ylim()[0] > -100.0
        names = {line.get_label(): line.get_color() for line in second.lines}
        same = {line.get_label(): line.get_color() for line in first.lines}
        dqn = next(name for name in same if name.startswith("dqn"))
        assert names[dqn] == same[dqn], "one group, one colour, in every panel"


def test_a_threshold_above_all_curves_is_not_drawn() -> None:
    """Training returns explore; that evaluations without exploration solve it they can't show."""
    low = [panel({"dqn": [seed([1, 2], [10, 400])]}, "CartPole-v1", 475.0)]
    for figure in (seed_curves(low), training_curves(low, "episode")):
        assert not lines(figure.axes[0], "threshold")


def test_a_variant_is_held_against_the_first_of_its_own_environment() -> None:
    low, high = seed([1, 2], [0, 1]), seed([1, 2], [0, 2])
    drawn = (("tuned", low, "A-v0"), ("mse", high, "A-v0"), ("other", high, "B-v0"))
    panels = [panel({name: [curve]}, env_id) for name, curve, env_id in drawn]
    figure = evaluation_curves(panels)
    first, second, third = (axes for axes in figure.axes if axes.axison)
    assert not lines(first, "reference") and not lines(third, "reference")
    (reference,) = lines(second, "reference")
    assert at(reference, 2) == 1 and at(the_mean(second), 2) == 2
    titles = [axes.get_title() for axes in (first, third)]
    assert titles == ["tuned (1 seed), A-v0", "other (1 seed), B-v0"]
