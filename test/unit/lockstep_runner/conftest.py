"""A runner on a world that is no more than a counter."""

from types import SimpleNamespace

import pytest
import rospy
from support.ros.lockstep_world import Counter

from lockstep_runner import notices
from lockstep_runner.runner import ScriptRunner


@pytest.fixture(autouse=True)
def _nothing_was_told(monkeypatch):
    monkeypatch.setattr(notices, "_told", set())


@pytest.fixture
def put_back(monkeypatch):
    """Has attributes be put back that a test replaces."""
    return lambda *places: [monkeypatch.setattr(*each, getattr(*each)) for each in places]


@pytest.fixture
def runner(monkeypatch):
    """For a script whose world is a `Counter`; nothing is replaced yet."""
    monkeypatch.setattr(rospy.rostime, "_rostime_current", None)
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", False)
    made = ScriptRunner(0.008, None, Counter())
    made.topics = SimpleNamespace(are_settled=True, commands=("/command",))
    yield made
    made.clock.release_all()
