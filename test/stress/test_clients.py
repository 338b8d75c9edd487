"""Forty clients send garbage, stop halfway or vanish: a good client is served all the while."""

import random
import time
from collections import Counter

import pytest
from gazebo_msgs.srv import GetModelState
from support.stress.bad_clients import SERVICE, BadClient
from support.stress.places import waits
from support.stress.scenario import Scenario
from support.stress.worlds import Usage, world

from ros_calls.service import ServiceClient

CLIENTS = 40
CONNECTIONS = 40  # of each, in a case
FEW = 10  # threads, files; of rosout, master and log, which connect when they like, and keep connections
GROWTH = 60.0  # [MiB] at most, while they are there and afterwards
LONGEST = 30.0  # [s] at most until the good client is answered, on a busy machine
full = pytest.mark.stress(full=True)


def few_more(now: Usage, before: Usage) -> bool:
    """Whether what the connections took has been given back."""
    return now.files <= before.files + FEW and now.threads <= before.threads + FEW


@pytest.mark.parametrize(
    "engine",
    [
        pytest.param("ode", marks=pytest.mark.stress),
        pytest.param("mujoco", marks=[full, pytest.mark.extras("mujoco")]),
    ],
)
def test_bad_clients(scenario: Scenario, engine: str) -> None:
    each = max(3, scenario.share(CONNECTIONS))
    done: Counter[str] = Counter()
    most: list[Usage] = []
    slowest = [0.0]
    with world(engine) as here, here.active():
        places = here.doors()
        good = ServiceClient(SERVICE, GetModelState, persistent=True, timeout=LONGEST)

        def served() -> None:
            begin = time.monotonic()
            assert good("ground_plane", "world").success
            assert here.models() == ["ground_plane"]  # by a connection of its own
            slowest[0] = max(slowest[0], time.monotonic() - begin)

        served()
        before = here.usage()

        def case(number: int, dice: random.Random) -> None:
            crowd = [BadClient(places, random.Random(dice.random()), each) for _ in range(CLIENTS)]
            for client in crowd:
                client.start()
            while any(client.is_alive() for client in crowd):
                served()
                most.append(here.usage())
                client.join(0.01)
            for client in crowd:
                client.join()
                done.update(client.done)
            served()
            here.check_time()

        row = scenario.run(f"bad clients, 40 at a time: {engine}", 10, case, unit=CLIENTS * each)
        gone = waits(lambda: few_more(here.usage(), before), 120)
        after = here.usage()
        peak = max(usage.memory for usage in most)
        row.notes += [
            ", ".join(f"{count:,} {kind}" for kind, count in sorted(done.items())),
            f"{before} → {after}, at most {peak:.0f} MiB",
            f"the good client waited {slowest[0]:.1f} s at most",
        ]
        assert gone, row.notes
        assert peak - before.memory < GROWTH, row.notes
        good.close()
