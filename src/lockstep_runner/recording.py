"""The bag of `lockstep.py --record`: its name is freed before, and it is completed after a run."""

import contextlib
import itertools
import os
from collections.abc import Iterator

from lockstep_runner import originals
from lockstep_runner.notices import tell
from lockstep_runner.world import NODE
from ros_calls import master

METHOD, COMMAND = "gazeboWorld", "end_journal"  # of the simulator's node
ACTIVE = ".active"  # the suffix of a bag that is being written
CLOSING = 20.0  # [s] for a simulator to end, or to complete the bag
LOOK = 0.05  # [s]


@contextlib.contextmanager
def recorded(path: str) -> Iterator[None]:
    """Lets the simulators that start within the block record: in a bag, and then in others with a number.

    Older files of these names are removed: the numbers of one recording have no gap, unlike dates in names of
    the user's.
    """
    stem, suffix = os.path.splitext(path)
    numbered = (f"{stem}.{number}{suffix}" for number in itertools.count(2))
    for bag in (path, *itertools.takewhile(_files, numbered)):
        for old in _files(bag):
            os.unlink(old)
    try:
        yield
    finally:
        _finish(path)


def _files(bag: str) -> list[str]:
    """Returns a bag's existing files, complete or not."""
    return [each for each in (bag, bag + ACTIVE) if os.path.exists(each)]


def _finish(path: str) -> None:
    with contextlib.suppress(master.NoAnswer, master.Refused):  # it has ended, or does
        address = master.call("lookupNode", NODE)
        master.call_node(address, METHOD, COMMAND, timeout=CLOSING)
    deadline = originals.monotonic() + CLOSING
    while os.path.exists(path + ACTIVE) and originals.monotonic() < deadline:
        originals.sleep(LOOK)
    if os.path.exists(path):
        tell(f"recorded {path}; what repeats it: rosrun cartpole replay.py {path}")
    elif os.path.exists(path + ACTIVE):
        tell(
            "the bag isn't complete: the simulator was killed, or the disk is full; what it holds: "
            f"rosbag reindex {path}{ACTIVE}"
        )
    else:
        tell("--record: the script started no simulator in lock-step, so nothing is recorded")
