"""A rostest that proved nothing must not pass."""

from __future__ import annotations

import os

import psutil
import pytest
from support.plugins import rostest_plugin

pytestmark = pytest.mark.slow

PACKAGE = """<package format="3"><name>probe</name><version>0.0.0</version><description/>
<maintainer email="probe@example.com">probe</maintainer><license>none</license></package>"""

NODE = """#!/usr/bin/env python3
import os, signal, time, unittest, rostest
class Probe(unittest.TestCase):
    def test_it(self):
        {body}
rostest.rosrun("probe", "probe", Probe)
"""


@pytest.fixture
def probe(tmp_path, monkeypatch):
    """Returns a function that runs a rostest whose only test has the given body."""
    package = tmp_path / "probe"
    (package / "test").mkdir(parents=True)
    (package / "package.xml").write_text(PACKAGE)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{package}:{os.environ['ROS_PACKAGE_PATH']}")

    def run(body, *, limit=30, launch=None):
        node = package / "test/probe_node.py"
        node.write_text(NODE.format(body=body))
        node.chmod(0o755)
        test = f'<test test-name="a" pkg="probe" type="probe_node.py" time-limit="{limit}"/>'
        file = package / "test/probe.test"
        file.write_text(f"<launch>{test if launch is None else launch}</launch>")
        rostest_plugin.run(file, tmp_path)

    return run


@pytest.mark.parametrize(
    ("body", "options", "text"),
    [
        ("self.assertEqual(1, 2)", {}, "1 != 2"),
        ("os.kill(os.getpid(), signal.SIGKILL)", {}, "probe.test"),
        ("pass", {"launch": ""}, "no test was executed"),
    ],
    ids=["failure", "death", "no test"],
)
def test_failure_fails(probe, body, options, text):
    with pytest.raises(rostest_plugin.RostestFailure, match=text):
        probe(body, **options)


def test_hang_is_ended(probe, monkeypatch):
    """The plugin ends it where rostest's own time limit doesn't, and leaves nothing behind."""
    monkeypatch.setattr(rostest_plugin, "time_limit", lambda path: 3.0)
    before = set(psutil.Process().children(recursive=True))
    with pytest.raises(rostest_plugin.RostestFailure, match="no end after 3 s"):
        probe("signal.pause()", limit=60)
    assert set(psutil.Process().children(recursive=True)) <= before
