"""The figures of a training on a disk that takes no more of them."""

import resource
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from rl_workbench.training import scalar_log
from rl_workbench.training.scalar_log import ScalarLog

LARGEST = 50_000  # [bytes]


@pytest.fixture
def small_files() -> Iterator[None]:
    """No file may grow beyond LARGEST."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_settings_with_bytes_that_are_no_text(tmp_path: Path) -> None:
    """A path may hold any."""
    ScalarLog(tmp_path, {"run_dir": "runs/\udcff"}).close()
    (events,) = tmp_path.glob("events*")
    assert rb"|run_dir|runs/\udcff|" in events.read_bytes()


@pytest.mark.usefixtures("small_files")
def test_tensorboards_file_that_may_not_grow_fails_where_it_is_written(tmp_path: Path) -> None:
    """The CSV has room still: a point is longer in TensorBoard's."""
    threads, log = threading.active_count(), ScalarLog(tmp_path, {})
    with pytest.raises(OSError, match="File too large"):
        for step in range(LARGEST):
            log.add(step, {"a": 1.0})
    assert (tmp_path / scalar_log.SCALARS).stat().st_size < LARGEST
    assert threading.active_count() == threads  # nothing that fails elsewhere
    with pytest.raises(OSError, match="File too large"):
        log.close()
    log.close()


def test_points_are_shown_before_the_file_is_full(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(scalar_log, "SHOWN_AFTER", 0.0)
    log = ScalarLog(tmp_path, {"gamma": 0.9})
    log.add(3, {"a": 1.5})
    shown = EventAccumulator(str(tmp_path))
    shown.Reload()
    assert [(point.step, point.value) for point in shown.Scalars("a")] == [(3, 1.5)]
    log.close()
