"""How long a spawner of controllers waits for their manager."""

import pytest
import rospy

from bullet_gazebo.clients import spawner


class Manager:
    """One that comes up after some waits in vain."""

    def __init__(self, waits):
        self.waits = waits

    def wait(self, services, timeout):
        self.waits -= 1
        return services[0] if self.waits >= 0 else None


@pytest.fixture(autouse=True)
def _time_has_begun(monkeypatch):
    monkeypatch.setattr(rospy, "get_param", lambda *_: False)


@pytest.mark.parametrize(
    ("spawns", "waits", "found"),
    [
        ([[0, 0], [1, 0], [1, 0], [0, 1]], 3, True),  # also where it has just ended
        ([[0, 1], [0, 1]], 1, False),
        ([[], []], 1, False),  # Gazebo itself says nothing
    ],
)
def test_it_waits_while_a_model_is_being_spawned(monkeypatch, spawns, waits, found):
    monkeypatch.setattr(spawner, "spawns", lambda: spawns.pop(0))
    assert (spawner._find(Manager(waits), 30.0) is None) == found
