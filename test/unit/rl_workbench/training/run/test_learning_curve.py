"""The picture of one training."""

from pathlib import Path

import numpy as np
import pytest

from rl_workbench.training.run.learning_curve import learning_curve, moving_average


def test_moving_average() -> None:
    values = [1.0, 2.0, 3.0, 4.0, 5.0]
    assert moving_average(values, 3) == pytest.approx([1.0, 1.5, 2.0, 3.0, 4.0])
    assert moving_average([], 3).shape == (0,)


@pytest.mark.parametrize("count", [1, 300])
def test_the_curve_is_a_png(tmp_path: Path, count: int) -> None:
    lengths = np.random.default_rng(0).integers(1, 3000, count).tolist()
    learning_curve(tmp_path / "curve.png", lengths, [length / 2 for length in lengths], "title")
    assert (tmp_path / "curve.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
