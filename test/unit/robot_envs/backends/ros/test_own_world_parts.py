"""The parts of a simulator of one's own that need none: its journal, and the checks of its answers."""

import math

import pytest

from robot_envs.backends.backend import Slot, connect_in_turn, join_in_turn, next_slot, side_by_side
from robot_envs.backends.ros.own_world import checked, replay
from robot_envs.errors import RobotEnvError, SimulatorFault
from robot_envs.variation import LinkScale, Variation
from robot_envs.world_state import InitialState, Joints, JointState, WorldState


def state(*joint: float, time: float = 0.0) -> WorldState:
    return WorldState(time, Joints(hinge=JointState(*joint)))


class Replayed:
    """A world that notes what it is asked, and whose state is the number of its steps."""

    def __init__(self, drift: float = 0.0) -> None:
        self.asked, self._drift = [], drift

    def reset(self, initial: InitialState, seed: int = 0) -> WorldState:
        self.asked.append(initial)
        return state(self._drift, 0.0, 0.0)

    def act(self, commands: dict) -> WorldState:
        self.asked.append(commands)
        return state(len(self.asked) - 1 + self._drift, 0.0, 0.0)

    def save_state(self) -> str:
        self.asked.append("save")
        return "a snapshot"


def test_a_journal_brings_another_simulator_to_the_same_state_or_says_where_it_differs() -> None:
    begun, commands = InitialState(), [{"a": 0.1}, {"a": -0.0}, {}, {"b": (1e-300, 2.0), "a": 3.0}]
    journal = [
        lambda world: world.reset(begun, 7),
        *(lambda world, each=each: world.act(each) for each in commands),
        lambda world: world.save_state(),
    ]
    last = state(4.0, 0.0, 0.0)
    world = Replayed()
    replay(journal, world, last)
    assert world.asked == [begun, *commands, "save"]
    words = "4 steps lead to another state.*: joints/hinge/position: 4.5 and 4.0"
    with pytest.raises(SimulatorFault, match=words):
        replay(journal, Replayed(drift=0.5), last)
    replay([], world, None)


def test_a_variation_leaves_what_it_does_not_name() -> None:
    first = Variation({"rod": LinkScale(2.0)}, {"hinge": 1.0}, gravity=0.5)
    second = Variation({"hand": LinkScale(3.0)}, {"hinge": 2.0}, gains={"arm": 1.5})
    links = {"rod": LinkScale(2.0), "hand": LinkScale(3.0)}
    both = Variation(links, {"hinge": 2.0}, gains={"arm": 1.5}, gravity=0.5)
    assert first.merged(second) == both


def test_a_plausible_answer_is_fine() -> None:
    answer = state(-1e6, 1e6, 1e6, time=0.3)
    assert checked(answer, 300_000_000) is answer


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (state(math.nan, 0.0, 0.0), "joint 'hinge' is out of all bounds: .*position=nan"),
        (state(1e9, 0.0, 0.0), "joint 'hinge' is out of all bounds"),
        (state(0.0, 0.0, -math.inf), "joint 'hinge' is out of all bounds: .*effort=-inf"),
        (state(0.0, 0.0, 0.0, time=0.3), "its time stands at 0.3 s .* and 0 s were asked for"),
        (state(0.0, 0.0, 0.0, time=math.nan), "its time stands at nan"),
    ],
)
def test_an_impossible_answer_is_a_fault(answer: WorldState, told: str) -> None:
    with pytest.raises(SimulatorFault, match=told):
        checked(answer, 0)


class World:
    """Begins and ends as one with a simulator does."""

    def __init__(self, events: list[str], fails: bool = False) -> None:
        self.slot, self._events, self._fails = next_slot(), events, fails
        events.append(f"start {self.slot.number}")
        connect_in_turn(self.connect, self.close)

    def connect(self) -> None:
        self._events.append(f"connect {self.slot.number}")
        if self._fails:
            raise RobotEnvError("no")

    def close(self) -> None:
        self._events.append(f"close {self.slot.number}")
        join_in_turn(lambda: self._events.append(f"wait {self.slot.number}"))


def test_a_block_begins_all_before_it_waits_for_one() -> None:
    events: list[str] = []
    with side_by_side(2):
        worlds = [World(events), World(events)]
    assert events == ["start 1", "start 2", "connect 1", "connect 2"]
    assert str(worlds[1].slot) == "simulator 2 of 2"
    events.clear()
    with side_by_side(2):
        for world in worlds:
            world.close()
    assert events == ["close 1", "close 2", "wait 1", "wait 2"]
    events.clear()
    assert World(events).slot == Slot()
    assert events == ["start 1", "connect 1"]


def test_where_one_does_not_start_all_are_ended() -> None:
    events: list[str] = []
    with pytest.raises(RobotEnvError), side_by_side(3):
        for number in range(3):
            World(events, fails=number == 1)
    ends = ["close 1", "close 2", "close 3", "wait 1", "wait 2", "wait 3"]
    assert events[3:] == ["connect 1", "connect 2", *ends]
