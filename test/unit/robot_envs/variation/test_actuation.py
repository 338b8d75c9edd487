"""What becomes of commands on their way: delay, limits, lag."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_envs.variation.imperfections import Actuator

PERIOD = 0.01  # [s]
KINDS = {"motor": False, "servo": True}  # of a motor's efforts, and of positions
numbers = st.floats(-1e6, 1e6)
commands = st.fixed_dictionaries({"motor": numbers, "servo": st.tuples(numbers, numbers)})


def run(actuator: Actuator, name: str, wanted: list, held: float | tuple = 0.0) -> list:
    """What arrives at one controller."""
    actuator.begin({name: held})
    return [actuator({name: each})[name] for each in wanted]


def test_without_options_commands_arrive_as_they_are():
    assert Actuator(KINDS, PERIOD).is_ideal
    assert Actuator(KINDS, PERIOD, lag={"motor": 0.0}).is_ideal
    for options in ({"delay": 1}, {"lag": 0.1}, {"limit": 1.0}, {"limit": {"motor": 0.0}}):
        assert not Actuator(KINDS, PERIOD, **options).is_ideal


@pytest.mark.slow
@given(st.lists(commands, max_size=8), st.integers(0, 4), commands)
def test_a_delay_shifts_all_commands_and_begins_with_what_is_held(sent, delay, held):
    actuator = Actuator(KINDS, PERIOD, delay=delay)
    for _ in range(2):  # episodes don't mix
        actuator.begin(held)
        assert [actuator(each) for each in sent] == ([held] * delay + sent)[: len(sent)]


def test_a_step_rises_as_the_lag_says():
    lag = 0.05
    risen = run(Actuator({"motor": False}, PERIOD, lag=lag), "motor", [2.0] * 30)
    expected = [2.0 * (1.0 - math.exp(-(k + 1) * PERIOD / lag)) for k in range(30)]
    assert risen == pytest.approx(expected, rel=1e-12)
    assert risen[4] == pytest.approx(2.0 * 0.632, rel=1e-3)  # after a time constant


@given(st.lists(numbers, min_size=1), st.floats(0.0, 1e3))
def test_efforts_are_cut_either_way(wanted, most):
    found = run(Actuator({"motor": False}, PERIOD, limit=most), "motor", wanted)
    assert found == [min(most, max(-most, each)) for each in wanted]


@given(st.lists(numbers, min_size=1), numbers, st.floats(1e-3, 1e3))
def test_positions_follow_no_faster_than_the_limit(wanted, held, speed):
    found = run(Actuator({"servo": True}, PERIOD, limit=speed), "servo", wanted, held)
    for before, after, aim in zip([held, *found], found, wanted, strict=False):
        assert abs(after - before) <= speed * PERIOD * (1 + 1e-6) + 1e-9
        assert after == aim or abs(after - aim) < abs(before - aim)


def test_first_the_delay_then_the_limit_then_the_lag():
    actuator = Actuator({"motor": False}, PERIOD, delay=1, limit=1.0, lag=0.02)
    alone = run(Actuator({"motor": False}, PERIOD, lag=0.02), "motor", [1.0] * 4)
    assert run(actuator, "motor", [5.0] * 5) == [0.0, *alone]


def test_each_number_of_a_group_goes_its_own_way():
    actuator = Actuator({"servo": True}, 0.1, limit=1.0, lag={"servo": 0.1})
    alone = [
        run(Actuator({"servo": True}, 0.1, limit=1.0, lag=0.1), "servo", [aim] * 6, held)
        for aim, held in ((0.5, 0.0), (-1.0, 2.0))
    ]
    together = run(actuator, "servo", [(0.5, -1.0)] * 6, (0.0, 2.0))
    assert together == list(zip(*alone, strict=True))


def test_those_that_a_mapping_leaves_out_are_ideal():
    actuator = Actuator(KINDS, PERIOD, lag={"servo": 0.1}, limit={"motor": 1.0})
    actuator.begin({"motor": 0.0, "servo": 0.0})
    arrived = actuator({"motor": 3.0, "servo": 3.0})
    assert arrived["motor"] == 1.0
    assert 0.0 < arrived["servo"] < 3.0


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"delay": -1}, "action_delay must be a number of control steps from 0 to 1000, not -1"),
        ({"delay": float("nan")}, "action_delay"),
        ({"lag": -0.1}, "actuator_lag must be a number >= 0, not -0.1"),
        ({"lag": {"motr": 0.1}}, "there is no controller 'motr'; did you mean 'motor'?"),
        ({"limit": -1.0}, "actuator_limit must be a number >= 0"),
        ({"limit": [1.0, 2.0]}, "actuator_limit"),
    ],
)
def test_what_can_not_be_is_refused(options, text):
    with pytest.raises(ValueError, match=text.replace("?", r"\?")):
        Actuator(KINDS, PERIOD, **options)
