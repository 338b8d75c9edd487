"""Polling before sleeping: for how long, when not at all, and that calls are the same with it.

Nothing is timed: clocks tell what the tests say.
"""

import math
import os

import pytest
from std_srvs.srv import SetBool, SetBoolRequest
from support.ros.ros_fakes import FakeService, ok

from ros_calls import polling
from ros_calls.polling import FIRST_REST, FORGIVEN, LONGEST, LONGEST_REST, RECENT, AdaptivePoll
from ros_calls.tcpros import Connection, ConnectionEnded

LOOK = 0.00001  # [s] that each look takes
BRIEF = 0.0002  # [s] of a wait


class Waits:
    """Waits of a thread that polls, with a clock of their own."""

    def __init__(self):
        self.now = 0.0
        self.poll = AdaptivePoll(lambda: self.now)

    def wait(self, length, look=LOOK):
        """Has something come after `length`; returns how often was looked for it."""
        looks, end = self.poll.looks, self.now + length

        def ready():
            self.now += look
            return self.now >= end

        self.poll.before(ready)
        self.now = max(self.now, end)
        self.poll.after()
        return self.poll.looks - looks

    def warm_up(self):
        for _ in range(RECENT):
            self.wait(BRIEF)


@pytest.fixture(autouse=True)
def machine(monkeypatch):
    """Two cores, on which nothing else runs; a test changes what it likes."""
    state = {"cores": 2, "running": 2}
    monkeypatch.delenv(polling.SWITCH, raising=False)
    monkeypatch.setattr(polling, "cores", lambda: state["cores"])
    monkeypatch.setattr(polling, "running", lambda: state["running"])
    return state


def test_waits_are_polled_once_it_is_known_that_they_are_short():
    waits = Waits()
    assert [waits.wait(BRIEF) for _ in range(RECENT)] == [0] * RECENT
    assert waits.wait(BRIEF) == pytest.approx(BRIEF / LOOK, abs=1)


def test_what_does_not_come_is_polled_for_twice_the_longest_of_the_last_and_never_longer_than_the_bound():
    waits = Waits()
    waits.warm_up()
    assert waits.wait(10.0) == pytest.approx(2 * BRIEF / LOOK, abs=1)
    assert [waits.wait(BRIEF) for _ in range(FIRST_REST)] == [0] * FIRST_REST
    waits.poll = AdaptivePoll(lambda: waits.now)
    for _ in range(RECENT):
        waits.wait(0.9 * LONGEST)
    assert waits.wait(10.0) == pytest.approx(LONGEST / LOOK, abs=1)


def test_nothing_is_polled_where_waits_are_long():
    waits = Waits()
    assert sum(waits.wait(1.5 * LONGEST) for _ in range(100)) == 0


def test_waits_of_no_length_are_polled_too():
    waits = Waits()
    assert [waits.wait(0.0) for _ in range(RECENT + 2)][-2:] == [1, 1]


@pytest.mark.parametrize("sign", ["nothing came", "the core was lost"])
def test_who_polls_in_vain_sleeps_for_longer_and_longer(sign):
    waits = Waits()
    waits.warm_up()
    rests = []
    for _ in range(10):
        if sign == "nothing came":
            assert waits.wait(LONGEST) > 1
        else:
            assert waits.wait(BRIEF, look=2 * polling.LOST) == 1
        rests.append(0)
        while not waits.wait(BRIEF):
            rests[-1] += 1
    assert rests == [min(FIRST_REST * 2**n, LONGEST_REST) for n in range(10)]
    for _ in range(10 * FORGIVEN):  # all is well for a while
        assert waits.wait(BRIEF)
    waits.wait(BRIEF, look=2 * polling.LOST)
    assert [bool(waits.wait(BRIEF)) for _ in range(FIRST_REST + 1)] == [False] * FIRST_REST + [True]


@pytest.mark.parametrize(("cores", "running"), [(2, 3), (4, 4), (4, 5), (64, 65), (2, math.inf)])
def test_nothing_is_polled_while_more_threads_want_to_run_than_there_are_cores(
    machine, cores, running
):
    machine["cores"] = cores
    waits = Waits()
    waits.warm_up()
    for others in (running, 2, running, 2):
        machine["running"] = others
        assert [bool(waits.wait(BRIEF)) for _ in range(100)] == [others <= cores] * 100


def test_it_can_be_switched_off_and_needs_a_second_core(machine, monkeypatch):
    polled = []
    for cores, switch in ((1, "1"), (2, "0"), (2, "1")):
        machine["cores"] = cores
        machine["running"] = 1
        monkeypatch.setenv(polling.SWITCH, switch)
        waits = Waits()
        polled.append(sum(waits.wait(BRIEF) for _ in range(2000)) > 0)
    assert polled == [False, False, True]


def test_the_kernel_tells_how_many_threads_want_to_run(monkeypatch):
    monkeypatch.undo()
    assert 1 <= polling.running() < 1e6  # in the file as this machine has it
    for text, running in (
        (b"0.10 0.20 0.30 2/345 678\n", 2),
        (b"", math.inf),
        (b"0.1 0.2 0.3 nonsense 5\n", math.inf),
    ):
        monkeypatch.setattr(os, "pread", lambda *_where, text=text: text)
        assert polling.running() == running


def test_calls_are_the_same_with_polling_and_an_end_is_told_at_once():
    ticks = iter(range(10**9))
    poll = AdaptivePoll(lambda: next(ticks) * 1e-6)  # however slow this machine is, waits are short
    service = FakeService()
    connection = Connection(service.address, "/fake", SetBool, 30.0, poll)
    try:
        answers = [connection.call(SetBoolRequest(n % 2 == 0), 30.0).success for n in range(50)]
        assert answers == [n % 2 == 0 for n in range(50)]
        assert poll.looks > 0
        service.break_off()
        with pytest.raises(ConnectionEnded):
            connection.call(SetBoolRequest(True), 30.0)
    finally:
        connection.close()
        service.close()


class Insistent(AdaptivePoll):
    """Takes some looks before each wait, however busy the machine is."""

    def before(self, ready):
        for _ in range(10):
            self.looks += 1
            if ready():
                return


def test_a_time_limit_holds_with_polling():
    poll = Insistent()
    answers = iter([True])
    service = FakeService(lambda request: [ok(request.data)] if next(answers, False) else None)
    connection = Connection(service.address, "/fake", SetBool, 30.0, poll)
    try:
        connection.call(SetBoolRequest(True), 30.0)
        looks = poll.looks
        with pytest.raises(TimeoutError):
            connection.call(SetBoolRequest(True), 0.05)
        assert poll.looks == looks + 10
    finally:
        connection.close()
        service.close()
