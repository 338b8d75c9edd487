"""When time passes for scripts that don't wait by themselves."""

import pytest

from lockstep_runner.triggers import Triggers


class Script:
    """Counts the periods that pass while a script publishes and waits."""

    def __init__(self, names=None):
        self.triggers = Triggers(names)
        self.periods = 0

    def publish(self, *topics, command=True):
        for topic in topics:
            for decide in (self.triggers.before, self.triggers.after):
                if decide(topic, command):
                    self.periods += 1
                    self.triggers.passed()
        return self.periods

    def call(self, service):
        if self.triggers.called(service):
            self.periods += 1
        return self.periods

    def poll(self, what, times=1, often=3):
        for _ in range(times):
            if self.triggers.polled(what, often, b""):
                self.periods += 1
                self.triggers.passed()
        return self.periods


@pytest.mark.parametrize("topics", [["/a"], ["/a", "/b", "/c"]])
def test_a_round_of_topics_lets_a_period_pass_from_the_second_one_on(topics):
    script = Script()
    # The first one's is made up for
    assert [script.publish(*topics) for _ in range(4)] == [0, 2, 3, 4]


def test_the_period_passes_behind_the_last_of_a_round():
    script = Script()
    script.publish("/a", "/b", "/a", "/b")
    before = script.periods
    assert script.publish("/a") == before
    assert script.publish("/b") == before + 1


def test_a_script_that_waits_by_itself_gets_none_until_it_waits_no_longer():
    script = Script()
    for _ in range(5):
        script.publish("/a")
        script.triggers.waited()
    assert script.periods == 0
    assert [script.publish("/a") for _ in range(4)] == [0, 2, 3, 4]


def test_what_is_no_command_lets_no_time_pass():
    script = Script()
    assert [script.publish("/chatter", command=False) for _ in range(3)] == [0, 0, 0]


def test_names_that_were_given_are_the_only_ones():
    script = Script(["/b", "/ask", "/never"])
    assert script.publish("/a", "/a", "/a") == 0
    assert script.publish("/b", command=False) == 1
    assert script.call("/other") == 1
    assert script.call("/ask") == 2
    assert script.poll("/ask", times=100) == 2
    assert script.triggers.unused() == ["/never"]


def test_none_switches_them_off():
    script = Script([])
    assert script.publish(*["/a"] * 5) == 0
    assert script.poll("/ask", times=100) == 0
    assert script.triggers.unused() == []


def test_polling_lets_time_pass_once_it_is_known_as_such():
    script = Script()
    assert script.poll("/ask", times=3) == 0
    assert script.poll("/ask") == 1  # the fourth in a row
    assert script.poll("/ask") == 1  # the state after it
    assert script.poll("/ask") == 2  # from now on the second look is one too many


def test_a_command_in_between_is_no_polling():
    script = Script()
    for _ in range(20):
        script.poll("/ask", times=2)
        script.publish("/chatter", command=False)
    assert script.periods == 0
