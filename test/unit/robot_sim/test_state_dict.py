"""States of controllers, plugins and tasks: by their own methods, or by attributes that are plain data."""

import io
import random
import threading
from collections import defaultdict, deque
from dataclasses import InitVar, dataclass, field
from types import SimpleNamespace
from typing import ClassVar, NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robot_sim.control.joint import JointHandle
from robot_sim.plain_data import pack, unpack
from robot_sim.state_dict import Held, Shared, StateError, Stateful, attributes_of, load, state_of, undoable


class Part(Stateful):
    """Whatever attributes a test wants."""

    def __init__(self, **attributes):
        vars(self).update(attributes)


class Slotted(Stateful):
    __slots__ = ("__hidden", "other", "size", "unset")
    non_persistent = ("other",)

    def __init__(self, size):
        self.size, self.__hidden, self.other = size, size, object()

    def grow(self):
        self.size += 1
        self.__hidden += 1

    def hidden(self):
        return self.__hidden


@dataclass
class Mutable:
    items: list
    known: ClassVar[list] = []


@dataclass
class Listed(list):
    size: int


@dataclass
class Unset:
    later: int = field(init=False)


@dataclass
class Initialised:
    size: InitVar[int]

    def __post_init__(self, size):
        self.cells = [0] * size


class Pair(NamedTuple):
    first: object
    second: object


FLOATS = st.floats(allow_nan=False, allow_infinity=False)
NUMBERS = st.integers() | FLOATS | st.text() | st.none() | st.binary()
VALUES = st.recursive(
    NUMBERS,
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner) | st.tuples(inner, inner),
    max_leaves=20,
)


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.dictionaries(st.text(), VALUES), st.dictionaries(st.text(), VALUES))
def test_attributes_are_again_what_they_were(before, after):
    part = Part()
    vars(part).update(before)  # any name, "self" too
    state = state_of(part)
    wanted = {name: repr(value) for name, value in before.items()}
    for value in before.values():
        if isinstance(value, list):
            value.append(1)
        if isinstance(value, dict):
            value["more"] = 1
    vars(part).update(after)
    for _ in range(2):
        load([(part, state)])
        assert {name: repr(value) for name, value in vars(part).items()} == wanted
        for value in vars(part).values():
            if isinstance(value, list):
                value.append(2)  # the state is not what the object holds
        vars(part).clear()


def test_parts_stay_the_same_objects_and_what_is_shared_is_left():
    inner, shared = Part(x=1), Shared()
    outer = Part(inner=inner, listed=[(inner, shared)], by_name={"a": inner}, shared=shared)
    state = state_of(outer)
    held = Held("Part", {"x": 1})
    assert state == {
        "inner": held, "listed": [(held, Held("Shared", None))], "by_name": {"a": held},
    }  # fmt: skip
    inner.x = 2
    load([(outer, state)])
    assert outer.inner is inner and inner.x == 1 and outer.shared is shared
    assert outer.listed == [(inner, shared)] and outer.by_name == {"a": inner}


@pytest.mark.parametrize(
    "hold",
    [
        lambda each: each, lambda *each: [*each], lambda *each: deque(each), lambda a: {"a": a},
        lambda each: Pair(1, each), Mutable,
    ],
)  # fmt: skip
def test_a_part_that_is_no_longer_there_is_named_and_never_becomes_plain_data(hold):
    inner = Part(x=1)
    outer = Part(held=hold(inner))
    state, inner.x = state_of(outer), 2
    load([(outer, state)])
    assert inner.x == 1 and outer.held == hold(inner)
    gone = "^Part.held: there is no Part here to take the state"
    for other in (None, hold(None), hold(Slotted(1))):
        outer.held = other
        with pytest.raises(StateError, match=gone):
            load([(outer, state)])


def test_parts_that_have_come_since_go_again():
    inner = Part(x=1)
    outer = Part(listed=[inner], queue=deque([inner]), place=[None])
    state = state_of(outer)
    outer.listed.append(Part(x=2))
    outer.queue.append(Part(x=2))
    outer.place[0] = Part(x=2)
    load([(outer, state)])
    assert outer.listed == [inner] and [*outer.queue] == [inner] and outer.place == [None]


def test_containers_keep_their_order_limits_defaults_and_fields():
    part = Part(
        queue=deque([1, 2], maxlen=2), names={"b": 1, (1, "a"): 2}, array=np.arange(3.0),
        slotted=Slotted(3), scalar=np.float32(0.1), pair=Pair([1], 2), mutable=Mutable([1]),
        counts=defaultdict(int, a=1),
    )  # fmt: skip
    state = state_of(part)
    part.counts["b"] += 1
    part.queue.append(3)
    part.names["b"] = part.names.pop("b") + 1
    part.array[:] = 7.0
    part.slotted.grow()
    part.slotted.unset = 1
    part.pair.first.append(5)
    part.mutable.items.append(5)
    load([(part, state)])
    assert list(part.queue) == [1, 2] and part.queue.maxlen == 2
    assert list(part.names.items()) == [("b", 1), ((1, "a"), 2)]
    assert part.array.tolist() == [0.0, 1.0, 2.0] and part.scalar == np.float32(0.1)
    assert part.pair == Pair([1], 2) and vars(part.mutable) == {"items": [1]}
    assert part.counts == {"a": 1} and part.counts["new"] == 0
    assert part.slotted.size == part.slotted.hidden() == 3 and not hasattr(part.slotted, "unset")


def test_records_keep_their_objects_generators_and_defaults():
    part = Part(pair=Pair(np.random.default_rng(1), defaultdict(list)), mutable=Mutable(random.Random(1)))
    state = state_of(part)
    drawn = part.pair.first.random(), part.mutable.items.random()
    load([(part, state)])
    assert (part.pair.first.random(), part.mutable.items.random()) == drawn
    assert part.pair.second["new"] == []


GENERATORS = [np.random.default_rng(1), np.random.Generator(np.random.Philox(1)), random.Random(1)]


@pytest.mark.parametrize("generator", GENERATORS, ids=("PCG64", "Philox", "Random"))
def test_random_numbers_come_again(generator):
    part = Part(generator=generator)
    state = state_of(part)
    drawn = [generator.random() for _ in range(5)]
    for present in (generator, None):
        part.generator = present
        load([(part, state)])
        assert present is None or part.generator is present
        assert [part.generator.random() for _ in range(5)] == drawn


@pytest.mark.parametrize(("kind", "place"), [("MT19937", "pos"), ("Philox", "buffer_pos")])
@pytest.mark.parametrize("seed", [1, 2])  # 2 has another seed sequence than the present one
@pytest.mark.parametrize("number", [-1, 10**9])
def test_a_generator_never_reads_beyond_its_numbers(kind, place, seed, number):
    state = state_of(np.random.Generator(getattr(np.random, kind)(seed)))
    (state["state"]["state"] if place == "pos" else state["state"])[place] = number
    generator = np.random.Generator(getattr(np.random, kind)(1))
    with pytest.raises(StateError, match="lies outside of its numbers"):
        load([(generator, state)])
    generator.random()


@pytest.mark.extras("torch")
def test_torchs_random_numbers_come_again():
    import torch

    part = Part(generator=torch.Generator())
    state = state_of(part)
    drawn = torch.rand(5, generator=part.generator).tolist()
    load([(part, state)])
    assert torch.rand(5, generator=part.generator).tolist() == drawn


def test_a_generator_spawns_the_same_again():
    generator = np.random.default_rng(np.random.SeedSequence(1, spawn_key=(2,), pool_size=8))
    generator.spawn(1)
    state = state_of(generator)
    spawned = [each.random() for _ in range(2) for each in generator.spawn(2)]
    for _ in range(2):
        load([(generator, state)])
        assert [each.random() for _ in range(2) for each in generator.spawn(2)] == spawned


def test_what_was_in_two_places_never_takes_the_state_of_another():
    for number in range(3):
        part = Part(train=np.random.default_rng(0), eval=np.random.default_rng(1))
        part.now = (part.train, part.eval, np.random.default_rng(2))[number]
        state = unpack(pack(state_of(part)))
        part.now = part.eval if number != 1 else part.train
        load([(part, state)])
        drawn = [each.random() for each in (part.train, part.eval, part.now)]
        assert drawn == [np.random.default_rng(each).random() for each in (0, 1, number)]
    gears = Part(low=Part(x=np.ones(2)), high=Part(x=9))
    gears.now = gears.low
    state = state_of(gears)
    load([(gears, state)])
    gears.now = gears.high
    with pytest.raises(StateError, match=r"^Part\.now: this Part is in two places"):
        load([(gears, state)])
    assert gears.high.x == 9


def test_a_class_may_say_itself_what_counts_and_what_it_does_with_it_leaves_the_snapshot():
    class Keeping:
        """Keeps the very list that it gets."""

        def __init__(self):
            self.file, self.counts = io.StringIO(), [1]

        def state_dict(self):
            return self.counts

        def load_state_dict(self, state):
            self.counts = state

    part = Part(own=Keeping())
    for state in (state_of(part)["own"].state, state_of(part.own)):
        for _ in range(3):
            part.own.counts.append(2)
            load([(part.own, state)])
            assert part.own.counts == [1]


def test_a_fault_of_its_own_is_named_and_the_rest_comes_back():
    class Faulty:
        def state_dict(self):
            return 1

        def load_state_dict(self, state):
            raise ValueError("no")

    class Worse(Faulty):
        def state_dict(self):
            raise ValueError("never")

    class Odd(Faulty):
        def state_dict(self):
            return {"lock": threading.Lock()}

    parts = [Faulty(), Part(x=1)]
    states = [state_of(part) for part in parts]
    parts[1].x = 2
    with pytest.raises(StateError, match=r"load_state_dict\(\) of .*Faulty.*no"):
        load(zip(parts, states, strict=True))
    assert parts[1].x == 1
    with pytest.raises(StateError, match=r"state_dict\(\) of .*Worse raised ValueError\('never'"):
        state_of(Part(inner=Worse()))
    odd = r"Odd.state_dict\(\): a snapshot can't save a _thread.lock"
    with pytest.raises(StateError, match=odd):
        state_of(Odd())


def test_attributes_that_are_not_persistent_stay_also_those_of_a_base():
    class Listening:
        non_persistent = ("heard",)

    class Speaking(Listening):
        non_persistent = ("said",)

    part = Speaking()
    part.heard, part.said, part.x = False, object(), 1
    state = state_of(part)
    part.heard, part.x, part.later = True, 2, 3
    load([(part, state)])
    assert part.heard and part.x == 1 and not hasattr(part, "later")


@pytest.mark.parametrize(
    ("odd", "name"),
    [
        ((each for each in "abc"), "builtins.generator"),
        (io.StringIO(), "_io.StringIO"),
        (Listed(2), "Listed whose attributes aren't its fields"),
        (Unset(), "Unset whose attributes aren't its fields"),
        (Initialised(2), "Initialised whose attributes aren't its fields"),
        (lambda: 0, "builtins.function"),
        (threading.Lock(), "_thread.lock"),
        ({1}, "builtins.set"),
        (random.SystemRandom(), "SystemRandom"),
        (np.array([object()]), "numpy.ndarray of object"),
        (np.zeros(1, "datetime64[s]"), r"numpy.ndarray of datetime64\[s\]"),
        (np.zeros(1, [("x", "f8")]), "numpy.ndarray of .*"),
        ({frozenset(): 1}, "frozenset as key"),
        ([{"a": (object(),)}], "builtins.object"),
        (Mutable([{1}]), "builtins.set in Mutable.items"),
    ],
    ids=lambda each: each if isinstance(each, str) else "",
)
def test_what_cannot_be_saved_is_named_with_class_attribute_and_methods(odd, name):
    told = rf"^Part.item: .*{name}; keep it in an object of its own with state_dict\(\)"
    with pytest.raises(StateError, match=told):
        state_of(Part(inner=Part(item=odd)))


def test_circles_are_named():
    part, items = Part(), []
    part.me = part
    with pytest.raises(StateError, match="Part.me refers to itself"):
        state_of(part)
    items.append(items)
    with pytest.raises(StateError, match="Part.items refers to itself"):
        state_of(Part(items=items))


def test_what_fails_as_a_whole_leaves_objects_where_they_were():
    inner, slotted = Part(x=1), Slotted(3)
    outer = Part(inner=inner, parts=[(inner, slotted)])
    with pytest.raises(StateError, match="load_state_dict is a method"), undoable(), undoable():
        load([(outer, {"parts": [], "load_state_dict": 1}), (slotted, {"size": 5})])
    assert outer.inner is inner and outer.parts == [(inner, slotted)] and slotted.size == 3


def test_arrays_keep_their_layout_and_what_a_view_showed():
    whole = np.arange(6.0).reshape(2, 3)
    view = whole[0]
    view.setflags(write=False)
    state = attributes_of(SimpleNamespace(view=view, turned=np.array(whole.T, order="F")))
    whole += 1.0
    assert state["view"].tolist() == [0.0, 1.0, 2.0] and not state["view"].flags.writeable
    back = unpack(pack(state))
    for each in (state, back):
        assert each["turned"].flags.f_contiguous
        assert each["turned"].tolist() == [[0.0, 3.0], [1.0, 4.0], [2.0, 5.0]]


class InTurn(Stateful):
    """A user's, which drives one joint after the other."""

    def __init__(self, *joints):
        self.joints, self.active = list(joints), joints[0]


def test_what_refers_to_another_joint_than_when_saved_is_named():
    part = InTurn(JointHandle("a", "revolute"), JointHandle("b", "revolute"))
    state = part.state_dict()
    part.load_state_dict(state)
    part.active = part.joints[1]
    with pytest.raises(StateError, match=r"InTurn.active: it refers to 'b', and to 'a'"):
        part.load_state_dict(state)
    part.active = part.joints[0]
    part.joints.reverse()
    with pytest.raises(StateError, match=r"InTurn.joints: it refers to 'b', and to 'a'"):
        part.load_state_dict(state)
