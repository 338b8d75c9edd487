"""Plain data as bytes: what comes back, and what damaged, forged and endless input leads to."""

import itertools
import math
import random
import struct
import sys
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from support.python import run_python
from support.refusals import refused

from robot_sim.physics.pose import Pose
from robot_sim.plain_data import Record, differences, misfit, pack, resolve, unpack
from robot_sim.state_dict import StateError


class Named(NamedTuple):
    number: float
    name: str


@dataclass(frozen=True)
class Frozen:
    inner: object
    numbers: tuple = ()

    def __post_init__(self):
        raise AssertionError("no code of a class runs")


@dataclass(frozen=True)
class Hashed:
    number: int

    def __hash__(self):
        raise AssertionError("no code of a class runs")


NUMBERS = st.integers(-(2**200), 2**200) | st.floats()
ATOMS = st.none() | st.booleans() | NUMBERS | st.text() | st.binary()
KINDS = st.sampled_from(["<f8", "<i4", "|u1", "|b1", "<f4"])
ARRAYS = arrays.arrays(KINDS, arrays.array_shapes(min_dims=0))
KEYS = st.text() | st.integers(-(2**63), 2**63) | st.tuples(st.text())
LISTS = st.sampled_from([list, tuple, lambda each: deque(each, 5)])


def containers(inner):
    lists = st.builds(lambda kind, each: kind(each), LISTS, st.lists(inner, max_size=4))
    named = st.builds(Named, st.floats(), st.text())
    return lists | st.dictionaries(KEYS, inner, max_size=4) | named


VALUES = st.recursive(ATOMS | ARRAYS, containers, max_leaves=20)


@settings(max_examples=60)
@given(VALUES)
def test_the_same_comes_back_to_the_bit(value):
    assert list(differences(value, unpack(pack(value)))) == []
    assert misfit(value, unpack(pack(value))) == ""


def test_records_are_made_without_their_classes_code():
    frozen = object.__new__(Frozen)
    object.__setattr__(frozen, "inner", Pose((1.0, 2.0, 3.0)))
    object.__setattr__(frozen, "numbers", (1, -0.0))
    back = unpack(pack(frozen))
    assert type(back) is Frozen and back.inner == frozen.inner and repr(back.numbers) == "(1, -0.0)"


def test_arrays_can_be_written_to_if_they_could():
    one, other = np.zeros(2), np.zeros(2)
    other.setflags(write=False)
    flags = [each.flags.writeable for each in unpack(pack([one, other]))]
    assert flags == [True, False]


def test_a_class_that_is_not_imported_stays_a_record_until_it_is():
    value = {"pose": [Record("some.module", "Class", [1, (2, 3)])]}
    data = pack(value)
    assert unpack(data) == value and "some" not in sys.modules
    with refused("some.module.Class", error=StateError):
        resolve(unpack(data))
    with refused(error=StateError):
        resolve([Record("some\nmodule", "Class", [])])


@pytest.mark.parametrize("value", [{1, 2}, open, object(), lambda: 1, sys, {"a": [random.Random()]}])
def test_what_is_not_plain_is_refused(value):
    with pytest.raises(StateError, match="isn't plain data"):
        pack(value)


@pytest.mark.parametrize(
    "value",
    ["\udcff", 2**3000, np.zeros(2, "M8[s]"), np.zeros(2, [("a", "f4")]), np.array(["a" * 12000])],
    ids=("half a character", "an integer", "dates", "a structure", "a long text"),
)
def test_what_could_not_be_read_is_not_written(value):
    with pytest.raises(StateError, match="it has an|can't be written"):
        pack(value)


def alike(keys):
    """A dictionary whose keys all have the same hash."""
    assert len(set(map(hash, keys))) == 1
    return b"\xdf" + struct.pack(">I", len(keys)) + b"".join(pack(key) + b"\xc0" for key in keys)


def extension(code, content):
    """An extension with the content, as it is written by `pack`."""
    packed = pack(content)
    return b"\xc9" + struct.pack(">IB", len(packed), code) + packed


def lists(depth, value):
    return b"\x91" * depth + value


FORGED = {
    "an array whose content is a number": extension(2, ["|u1", [-1], True, 2**33]),
    "a deque without end": extension(5, [2**64 - 1, []]),
    "an ordered dictionary": extension(4, ["collections", "OrderedDict", {"a": 1}]),
    "a dictionary with a factory": extension(4, ["collections", "defaultdict", {"a": 1}]),
    "long lists in long lists": (b"\xdd" + struct.pack(">I", 2**22)) * 500,
    "lists in lists, and in tuples": lists(900, b"\xc7" + struct.pack(">BB", 3, 1) + lists(2, b"\xc0")),
    "a record as a key": b"\x81" + extension(4, [__name__, "Hashed", [1]]) + b"\xc0",
    "integers with one hash": alike([each * (2**61 - 1) for each in range(1, 500)]),
    "tuples with one hash": alike([*itertools.product((-1, -2), repeat=8)]),
    "a huge array": b"\xdd\xff\xff\xff\xff",
    "a huge map": b"\xdf\xff\xff\xff\xff",
    "a huge text": b"\xdb\xff\xff\xff\xff",
    "no end": b"\x91" * 100_000,
    "an object array": b"\xc7\x0b\x02\x94\xa2|O\x90\xc3\xc4\x00\xff\xff",
}


@pytest.mark.parametrize("data", FORGED.values(), ids=FORGED)
def test_forged_input_is_one_error(data):
    with refused(error=StateError):
        unpack(data)


def test_entries_have_an_end_also_those_within_others(monkeypatch):
    monkeypatch.setattr("robot_sim.plain_data.MOST", 1000)
    value = [[[None] * 10] * 10, ((None,) * 90,) * 10]
    assert unpack(pack([value[0]])) and unpack(pack(value[1]))
    with pytest.raises(StateError, match="more than 1000 entries"):
        unpack(pack(value))


def nested(depth, content=None):
    """A content in tuples, each within another one."""
    value = pack(content)
    for _ in range(depth):
        value = b"\xc9" + struct.pack(">IB", len(value) + 1, 1) + b"\x91" + value
    return value


@pytest.mark.parametrize("value", [[deque()] * 100, nested(90, bytes(10_000))], ids=("deques", "copies"))
def test_memory_has_an_end_also_for_what_takes_few_bytes(value, monkeypatch):
    monkeypatch.setattr("robot_sim.plain_data.MOST", 1000)
    monkeypatch.setattr("robot_sim.plain_data.MOST_COPIED", 1000)
    assert unpack(pack([deque()] * 50)) and unpack(nested(3, bytes(10_000)))
    with pytest.raises(StateError, match="more than 1000 entries|too much in extensions"):
        unpack(value if isinstance(value, bytes) else pack(value))


def test_nesting_has_an_end_where_it_is_read_and_where_it_is_written():
    assert unpack(nested(50)) is not None
    with pytest.raises(StateError):
        unpack(nested(5000))
    value = []
    for _ in range(200):
        value = [value]
    with pytest.raises(StateError, match="nested too deeply"):
        pack(value)


def test_ten_thousand_damaged_inputs_are_read_or_refused():
    """In a process of its own, whose memory is bounded: each is one error, or plain data."""
    program = """
import random, resource, sys
import numpy as np
from robot_sim.plain_data import pack, unpack
from robot_sim.physics.pose import Pose
from robot_sim.state_dict import StateError
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
modules, rng, read = set(sys.modules), random.Random(1), 0
value = {"a": [1.5, (2, "x"), b"yz"], "p": Pose((1.0, 2.0, 3.0)), "n": np.arange(6.0).reshape(2, 3),
         "g": 2**127, 3: None, "s": np.float32(1.0)}
good = pack(value)
for _ in range(10_000):
    data = bytearray(good)
    for _ in range(rng.randint(1, 4)):
        kind, place = rng.randrange(3), rng.randrange(len(data))
        if kind == 0: data[place] = rng.randrange(256)
        elif kind == 1: del data[place:place + rng.randint(1, 9)]
        else: data[place:place] = bytes(rng.randrange(256) for _ in range(rng.randint(1, 9)))
        if not data: data = bytearray(b"x")
    try:
        unpack(bytes(data)); read += 1
    except StateError:
        pass
assert set(sys.modules) == modules, set(sys.modules) - modules
print(read)
"""
    done = run_python(program, check=False)
    assert done.returncode == 0, done.stderr
    assert 0 < int(done.stdout) < 10_000


def test_a_time_of_messagepack_is_a_number():
    assert unpack(b"\xd6\xff\x00\x00\x00\x05") == 5.0


def test_what_takes_the_place_of_what():
    for number in (float("nan"), float("inf")):
        assert misfit({"steps": 3}, {"steps": number}) == f"steps is {number}"
    three, five = np.zeros(3), np.zeros(5)
    assert misfit(three, five) == ""
    assert misfit(three, five, "efforts", exactly=True).startswith("efforts is an array")
    assert misfit([math.inf, 1.0], [math.inf, math.nan], exactly=True) == "1 is nan"
    assert misfit((1.0, [2]), (np.float64(3.0), [np.int32(4)])) == ""
    assert misfit({"a": np.float64(1.0)}, {"a": "x"}) == "a is a str, not a float"
