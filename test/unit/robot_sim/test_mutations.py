"""Mutated models and parameters, all through the public reading functions: a model, or one clear line."""

from collections import Counter

import pytest
from hypothesis import HealthCheck, given, settings
from support.mutations.models import CASES, CONTROLLERS, spawn

EXAMPLES = {"xacro": 8}  # each takes a process; of the others 150
QUICK = settings(deadline=None, database=None, derandomize=True, suppress_health_check=[*HealthCheck])


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_a_mutated_model_is_read_or_refused(name):
    case = CASES[name]
    seen: Counter[bool] = Counter()

    @settings(QUICK, max_examples=EXAMPLES.get(name, 150))
    @given(case.texts)
    def look(text):
        seen[case.read(text) == "read"] += 1

    look()
    # Without some of each, hardly anything was looked at.
    assert name in EXAMPLES or (seen[True] and seen[False])


def test_a_duration_beyond_all_clocks_is_one():
    arm = CONTROLLERS["position_arm"] | {"constraints": {"goal_time": 1e308}}
    assert CASES["controllers"].read(CONTROLLERS | {"position_arm": arm}) == "read"


def test_a_mutated_model_that_is_read_stands_in_a_world(make_world):
    world, seen = make_world(), Counter()

    @settings(QUICK, max_examples=60)
    @given(CASES["entity"].texts)
    def look(text):
        seen[spawn(world, text) == "read"] += 1

    look()
    assert seen[True]
