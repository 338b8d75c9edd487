"""What a session does where its simulator dies while robots are brought up."""

from collections.abc import Callable
from functools import partial
from types import SimpleNamespace

import pytest
import rospy

from robot_envs.backends.ros import gazebo, node, session
from robot_envs.backends.ros.session import RosSession
from robot_envs.errors import RobotEnvError, SimulatorFault

BROKE = SimulatorFault("/gazebo/spawn_urdf_model: the connection broke; its node has ended")


class Simulators:
    """Those that are started, none of which is real; some die as soon as a robot comes.

    Args:
        deaths: how many die.
        running: whether there is one already.
    """

    def __init__(self, deaths: int, running: bool = False) -> None:
        self.deaths, self.is_there, self.started, self.ended = deaths, running, 0, 0

    def start(self, its_session: RosSession) -> None:
        self.is_there, self.started = True, self.started + 1
        its_session._undo.callback(self.end)

    def end(self) -> None:
        self.is_there, self.ended = False, self.ended + 1

    def bring_up(self, *_: object) -> list[Callable[[], object]]:
        if self.deaths:
            self.is_there, self.deaths = False, self.deaths - 1
            raise BROKE
        return []


@pytest.fixture
def session_with(monkeypatch) -> Callable[[Simulators], RosSession]:
    def made(simulators: Simulators) -> RosSession:
        monkeypatch.setattr(rospy.core, "is_initialized", lambda: False)
        monkeypatch.setattr(node, "master_is_up", lambda: simulators.is_there)
        monkeypatch.setattr(gazebo, "simulator_answers", lambda: simulators.is_there)
        monkeypatch.setattr(gazebo, "check_world", lambda robot: None)
        monkeypatch.setattr(session, "bring_up", simulators.bring_up)
        monkeypatch.setattr(session, "Scene", lambda robots: SimpleNamespace(robots=robots))
        monkeypatch.setattr(RosSession, "_become_node", lambda self: None)
        monkeypatch.setattr(RosSession, "_check_mode", lambda self: None)
        made = RosSession(
            [SimpleNamespace(world=None)], "/a", [], realtime=False, gui=False, seed=0
        )
        monkeypatch.setattr(made, "_start_simulator", partial(simulators.start, made))
        return made

    return made


def test_one_that_it_started_is_replaced_once(session_with) -> None:
    simulators, said = Simulators(deaths=1), []
    its_session = session_with(simulators)
    its_session.start(said.append)
    assert said == ["starting the simulator"] * 2
    assert (simulators.started, simulators.ended, simulators.is_there) == (2, 1, True)
    its_session.close()
    assert simulators.ended == 2


@pytest.mark.parametrize(
    ("simulators", "started"), [(Simulators(2), 2), (Simulators(1, running=True), 0)],
    ids=["twice", "somebody else's"],
)  # fmt: skip
def test_a_second_death_and_that_of_somebody_elses_are_errors(
    session_with, simulators, started
) -> None:
    its_session = session_with(simulators)
    with pytest.raises(SimulatorFault, match="spawn_urdf_model: the connection broke"):
        its_session.start(lambda text: None)
    its_session.close()
    assert simulators.started == simulators.ended == started


def test_what_a_living_one_refuses_is_refused(session_with, monkeypatch) -> None:
    simulators = Simulators(0)
    its_session = session_with(simulators)

    def refuse(*_: object) -> None:
        raise RobotEnvError("'cart' can't be spawned")

    monkeypatch.setattr(session, "bring_up", refuse)
    with pytest.raises(RobotEnvError, match="can't be spawned"):
        its_session.start(lambda text: None)
    assert simulators.started == 1
    its_session.close()
