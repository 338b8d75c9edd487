"""Where no master is."""

import socket

import pytest


@pytest.fixture
def no_master(monkeypatch, tmp_path):
    """A master address where nobody listens, and folders of this test's own."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{probe.getsockname()[1]}")
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
