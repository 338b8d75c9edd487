"""Records that somebody changed, where it costs no training."""

import json
from pathlib import Path

import pytest
from support.training.training_runs import record, resume, summary


@pytest.mark.parametrize("versions", [None, ["python"], 3])
def test_versions_of_another_type_are_not_compared(stopped: Path, versions: object) -> None:
    content = record(stopped) | {"versions": versions}
    (stopped / "config.json").write_text(json.dumps(content))
    assert summary(resume(stopped))["complete"]


def test_the_length_may_be_changed_where_the_run_has_it(stopped: Path) -> None:
    """DQN's own options have it, too, for the share of exploration; it is written down once."""
    content = record(stopped)
    assert "total_timesteps" not in content["hyperparameters"]
    content["run"]["total_timesteps"] = 90
    (stopped / "config.json").write_text(json.dumps(content))
    assert summary(resume(stopped))["steps"] == 90


def test_a_record_that_has_the_length_twice_is_read_too(stopped: Path) -> None:
    """As those of before had it; the run's counts."""
    content = record(stopped)
    content["hyperparameters"]["total_timesteps"] = 77
    (stopped / "config.json").write_text(json.dumps(content))
    assert summary(resume(stopped))["steps"] == content["run"]["total_timesteps"]
