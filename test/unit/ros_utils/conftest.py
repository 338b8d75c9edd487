"""Where no master is."""

import pytest


@pytest.fixture
def no_master(nobody_listens, monkeypatch, tmp_path):
    """A master's address where nobody listens, and folders of this test's own."""
    monkeypatch.setenv("ROS_MASTER_URI", nobody_listens)
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
