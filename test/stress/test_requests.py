"""Odd values to every service, topic and XML-RPC method: the node stays alive, answers, and is intact."""

import json
import random
import sys
from collections import Counter

import pytest
from support.stress.places import BOUND
from support.stress.scenario import Scenario
from support.stress.worlds import world

BATCHES, BATCH = 10, 1000
full = pytest.mark.stress(full=True)


@pytest.mark.parametrize(
    ("engine", "mode"),
    [
        pytest.param("ode", "lockstep:=false", marks=pytest.mark.stress),
        pytest.param("mujoco", "lockstep:=true", marks=[full, pytest.mark.extras("mujoco")]),
    ],
)
def test_odd_requests(scenario: Scenario, engine: str, mode: str) -> None:
    size, sent = max(150, scenario.share(BATCHES * BATCH) // scenario.share(BATCHES)), Counter()
    with world(engine, mode) as here:

        def case(number: int, dice: random.Random) -> None:
            command = [sys.executable, "-m", "support.stress.odd_calls"]
            odd = here.place.start(*command, str(dice.randrange(2**31)), str(size))
            assert odd.end(20 * BOUND) == 0, odd.output[-3000:]
            sent.update(json.loads(odd.output.splitlines()[-1])["sent"])
            here.check()
            if "false" in mode:
                here.check_time()

        row = scenario.run(f"odd requests: {engine}", BATCHES, case, unit=size)
        row.notes.append(", ".join(f"{count:,} {kind}" for kind, count in sent.items()))
        row.notes.append(f"then {here.usage()}")
