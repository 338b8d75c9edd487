"""Damaged models, worlds, parameters and meshes: read and spawned, or refused, and the node lives."""

import json
import random
import sys
from collections import Counter

import pytest
from support.stress.places import BOUND
from support.stress.scenario import Scenario
from support.stress.worlds import world

BATCHES, BATCH = 20, 50
full = pytest.mark.stress(full=True)


@pytest.mark.parametrize(
    "engine",
    [
        pytest.param("ode", marks=pytest.mark.stress),
        pytest.param("mujoco", marks=[full, pytest.mark.extras("mujoco")]),
    ],
)
def test_damaged_files(scenario: Scenario, engine: str) -> None:
    size = max(20, scenario.share(BATCHES * BATCH) // scenario.share(BATCHES))
    done: Counter[str] = Counter()
    with world(engine) as here:

        def case(number: int, dice: random.Random) -> None:
            numbers = (str(dice.randrange(2**31)), str(size), str(here.place.folder))
            odd = here.place.start(sys.executable, "-m", "support.stress.odd_files", *numbers)
            assert odd.end(20 * BOUND) == 0, odd.output[-4000:]
            done.update(json.loads(odd.output.splitlines()[-1]))
            here.check()
            here.check_time()

        row = scenario.run(f"damaged files: {engine}", BATCHES, case, unit=size)
        for outcome in ("read", "refused", "spawned", "not spawned"):
            counts = (count for kind, count in done.items() if kind.split(" ", 1)[1] == outcome)
            row.notes.append(f"{sum(counts):,} {outcome}")
        row.notes.append(f"then {here.usage()}")
