"""What a session does where its simulator dies while robots are brought up."""

from types import SimpleNamespace

import pytest
import rospy

from robot_envs.backends.ros import node, session
from robot_envs.backends.ros.session import RosSession
from robot_envs.errors import SimulatorFault

RUNNING = "robot_envs.backends.ros.running"


@pytest.mark.parametrize(
    ("deaths", "running", "started"), [(1, False, 2), (2, False, 2), (1, True, 0)],
    ids=["once", "twice", "somebody else's"],
)  # fmt: skip
def test_one_that_it_started_is_replaced_once(monkeypatch, deaths, running, started) -> None:
    its = SimpleNamespace(deaths=deaths, is_there=running, started=0, ended=0)

    def end() -> None:
        its.is_there, its.ended = False, its.ended + 1

    def start() -> None:
        its.is_there, its.started = True, its.started + 1
        made._undo.callback(end)

    def bring_up(*_: object) -> list[object]:
        if its.deaths:
            its.is_there, its.deaths = False, its.deaths - 1
            raise SimulatorFault("the connection broke")
        return []

    monkeypatch.setattr(rospy.core, "is_initialized", lambda: False)
    monkeypatch.setattr(node, "master_is_up", lambda: its.is_there)
    monkeypatch.setattr(f"{RUNNING}.simulator_answers", lambda: its.is_there)
    monkeypatch.setattr(f"{RUNNING}.check_world", lambda robot: None)
    monkeypatch.setattr(session, "bring_up", bring_up)
    monkeypatch.setattr(session, "Scene", lambda robots: SimpleNamespace(robots=robots))
    made = RosSession(
        [SimpleNamespace(world=None, physics_step=None)],
        "/a",
        [],
        realtime=False,
        gui=False,
        seed=0,
    )
    for name, does in (
        ("_start_simulator", start),
        ("_become_node", lambda: None),
        ("_check_mode", lambda: None),
    ):
        monkeypatch.setattr(made, name, does)
    if deaths == 1 and not running:
        made.start(lambda text: None)
        assert (its.is_there, its.ended) == (True, 1)
    else:
        with pytest.raises(SimulatorFault, match="the connection broke"):
            made.start(lambda text: None)
    made.close()
    assert its.started == its.ended == started
