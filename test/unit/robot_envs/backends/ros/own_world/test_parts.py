"""The parts of a simulator of one's own that need none: its journal, what its answers are held to, memory."""

import math

import pytest

from robot_envs.backends.ros.own_world import memory
from robot_envs.backends.ros.own_world.health import checked
from robot_envs.backends.ros.own_world.journal import Journal, merged
from robot_envs.backends.side_by_side import Place, connect, next_place, side_by_side, wait_for_end
from robot_envs.errors import RobotEnvError, SimulatorFault
from robot_envs.variation import LinkScale, Variation
from robot_envs.world_state import InitialState, Joints, JointState, WorldState


def state(*joint: float, time: float = 0.0) -> WorldState:
    return WorldState(time, Joints(hinge=JointState(*joint)))


def test_a_journal_gives_back_what_was_commanded() -> None:
    given = [{"a": 0.1}, {"a": -0.0}, {}, {}, {"b": (1e-300, 2.0), "a": 3.0}, {"a": 5.0}]
    journal = Journal()
    journal.begin(InitialState(), state(0.0, 0.0, 0.0))
    for commands in given:
        journal.add(commands, state(1.0, 0.0, 0.0))
    assert repr(list(journal.commands())) == repr(given)
    assert (journal.steps, journal.last) == (6, state(1.0, 0.0, 0.0))
    journal.begin(InitialState(), state(2.0, 0.0, 0.0))
    assert (journal.steps, list(journal.commands())) == (0, [])


def test_a_variation_leaves_what_it_does_not_name() -> None:
    first = Variation({"rod": LinkScale(2.0)}, {"hinge": 1.0}, gravity=0.5)
    second = Variation({"hand": LinkScale(3.0)}, {"hinge": 2.0}, gains={"arm": 1.5})
    assert merged(first, second) == Variation(
        {"rod": LinkScale(2.0), "hand": LinkScale(3.0)},
        {"hinge": 2.0},
        gains={"arm": 1.5},
        gravity=0.5,
    )


def test_what_can_be_is_fine() -> None:
    assert checked(state(-1e6, 1e6, 1e6, time=0.3), 300_000_000)


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (state(math.nan, 0.0, 0.0), "joint 'hinge' is not finite: position nan"),
        (state(0.0, 0.0, -math.inf), "joint 'hinge' is not finite.* effort -inf"),
        (state(0.0, 1e10, 0.0), "joint 'hinge' is out of all bounds.* velocity 1e\\+10"),
        (state(0.0, 0.0, 0.0, time=0.008), "its time stands at 0.008 s .* and 0 s were asked for"),
        (state(0.0, 0.0, 0.0, time=math.nan), "its time stands at nan"),
    ],
)
def test_what_cannot_be_is_a_fault(answer: WorldState, told: str) -> None:
    with pytest.raises(SimulatorFault, match=told):
        checked(answer, 0)


def test_more_than_there_is_memory_for_is_refused(monkeypatch, tmp_path) -> None:
    meminfo = tmp_path / "meminfo"
    meminfo.write_text("MemTotal: 24105000 kB\nMemAvailable:  1000000 kB\n")
    monkeypatch.setattr(memory, "MEMINFO", meminfo)
    monkeypatch.setattr(memory, "CONTROL_GROUP", tmp_path)
    memory.check(8)
    with pytest.raises(
        RobotEnvError, match=r"^16 simulators need about 1.9 GB .* 1.0 GB are free: .*$"
    ):
        memory.check(16)
    (tmp_path / "memory.max").write_text("500000000\n")
    (tmp_path / "memory.current").write_text("450000000\n")
    (tmp_path / "memory.stat").write_text("anon 1\ninactive_file 30000000\n")
    with pytest.raises(RobotEnvError, match=r"^a simulator needs about 120 MB .* 80 MB are free"):
        memory.check(1)
    (tmp_path / "memory.max").write_text("max\n")
    memory.check(8)


class World:
    """Begins and ends as one with a simulator does."""

    def __init__(self, events: list[str], fails: bool = False) -> None:
        self.place, self._events, self._fails = next_place(), events, fails
        events.append(f"start {self.place.number}")
        connect(self)

    def connect(self) -> None:
        self._events.append(f"connect {self.place.number}")
        if self._fails:
            raise RobotEnvError("no")

    def close(self) -> None:
        self._events.append(f"close {self.place.number}")
        wait_for_end(lambda: self._events.append(f"wait {self.place.number}"))


def test_a_block_begins_all_before_it_waits_for_one() -> None:
    events: list[str] = []
    with side_by_side(2):
        worlds = [World(events), World(events)]
    assert events == ["start 1", "start 2", "connect 1", "connect 2"]
    assert str(worlds[1].place) == "simulator 2 of 2"
    events.clear()
    with side_by_side(2):
        for world in worlds:
            world.close()
    assert events == ["close 1", "close 2", "wait 1", "wait 2"]
    events.clear()
    assert World(events).place == Place()
    assert events == ["start 1", "connect 1"]


def test_where_one_does_not_start_all_are_ended() -> None:
    events: list[str] = []
    with pytest.raises(RobotEnvError), side_by_side(3):
        for number in range(3):
            World(events, fails=number == 1)
    assert events[3:] == [
        "connect 1", "connect 2", "close 1", "close 2", "close 3", "wait 1", "wait 2", "wait 3",
    ]  # fmt: skip
