"""The PID against the contract's check vectors (docs/contract/ros_control.md 4), and what it refuses."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_sim.control.errors import ControlError
from robot_sim.control.pid import Gains, Pid


@pytest.mark.parametrize(
    ("gains", "errors", "wanted", "times"),
    [
        (Gains(1, 1, 1, 5, -5), [-0.5, -0.5, -1.0], [-1.5, -1.5, -3.5], [1.0] * 3),
        (Gains(0, 0, 1), [-0.5, -0.5, -1.0, -0.5], [-0.5, 0.0, -0.5, 0.5], [1.0] * 4),
        (Gains(0, 2, 0, 1, -1, True), [-1, -1, 0.5, -1], [-1, -1, 0, -1], [1.0] * 4),
        (Gains(0, -2.5, 0, 0.5, -0.2, True), [0.1, 0.1, -0.05], [-0.2, -0.2, -0.075], [1.0] * 3),
        (Gains(0, 100, 0), [1.0, 1.0], [0.0, 0.0], [1.0] * 2),  # no i_clamp, no integral
        (Gains(100, 0.01, 10), [0.05, 0.05], [505.0, 5.0], [0.001] * 2),  # kicks for one tick
        # Time that goes backwards integrates backwards, to 0, and keeps the rate, 1.
        (Gains(0, 1, 1, 5, -5), [1.0, 1.0], [2.0, 1.0], [1.0, -1.0]),
    ],
)
def test_check_vectors(gains, errors, wanted, times):
    pid = Pid(gains)
    pid.clear()
    assert list(map(pid.compute, errors, times)) == pytest.approx(wanted)


def test_without_antiwindup_the_integral_winds_behind_its_clamp_and_unseeded_there_is_no_kick():
    pid = Pid(Gains(0, 1, 0, 1, -1))
    pid.clear()
    for _ in range(5):
        assert pid.compute(1.0, 1.0) == 1.0
    assert pid.i_error == 5.0
    assert Pid(Gains(1, 0, 10)).compute(0.5, 0.001) == 0.5


@pytest.mark.parametrize("error", [math.nan, math.inf, -math.inf])
def test_a_bad_error_gives_nothing_and_leaves_the_state(error):
    pid = Pid(Gains(1, 1, 1, 5, -5))
    pid.clear()
    pid.compute(0.5, 1.0)
    before = (pid.i_error, pid.last_error, pid.d_error)
    assert pid.compute(error, 1.0) == 0.0
    assert pid.compute(1.0, 0.0) == 0.0
    assert (pid.i_error, pid.last_error, pid.d_error) == before


finite = st.floats(-1e3, 1e3)


@given(st.lists(finite, min_size=1, max_size=30), finite, st.floats(0.0, 50.0), st.booleans())
def test_the_integral_term_never_leaves_its_clamp(errors, i, clamp, antiwindup):
    pid = Pid(Gains(0.0, i, 0.0, clamp, -clamp, antiwindup))
    for error in errors:
        assert abs(pid.compute(error, 0.01)) <= clamp * (1 + 1e-9) + 1e-12


@pytest.mark.parametrize(
    ("params", "gains"),
    [
        ({"p": 100}, Gains(100.0)),
        ({"p": 1, "i": 2, "d": 3, "i_clamp": -4}, Gains(1, 2, 3, 4, -4)),
        ({"p": 1, "i_clamp": 4, "i_clamp_max": 2.0, "i_clamp_min": 1.0}, Gains(1, 0, 0, 2, 0)),
        ({"p": 1, "antiwindup": True}, Gains(1, antiwindup=True)),
    ],
)
def test_gains_from_parameters(params, gains):
    assert Gains.from_params(params, "c/pid") == gains


@pytest.mark.parametrize(
    ("params", "text"),
    [
        ({}, "No p gain specified for pid. Namespace: c/pid"),
        (None, "No p gain"),
        ({"p": "1e3"}, "c/pid/p is '1e3'"),
        ({"p": 1, "d": math.nan}, "c/pid/d is nan"),
        ({"p": True}, "c/pid/p is True"),
    ],
)
def test_bad_gains_are_refused_with_their_place(params, text):
    with pytest.raises(ControlError, match=text.replace("(", r"\(")):
        Gains.from_params(params, "c/pid")
