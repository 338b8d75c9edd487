"""What objects hold is put back into the same objects."""

import array
import io
import queue
import random
import threading
from collections import Counter, OrderedDict, defaultdict, deque
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robot_sim.held_state import HeldState, UnknownState


class Part:
    """Whatever attributes a test wants."""

    def __init__(self, **attributes):
        vars(self).update(attributes)


class Slotted:
    __slots__ = ("__hidden", "size", "unset")

    def __init__(self, size):
        self.size, self.__hidden = size, size

    def grow(self):
        self.size += 1
        self.__hidden += 1

    def hidden(self):
        return self.__hidden


@dataclass(frozen=True)
class Frozen:
    items: list = field(default_factory=list)


class Pair(NamedTuple):
    first: object
    second: object


NUMBERS = st.integers() | st.floats(allow_nan=False) | st.text() | st.none()
VALUES = st.recursive(
    NUMBERS,
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner) | st.tuples(inner, inner),
    max_leaves=20,
)


@settings(deadline=None, suppress_health_check=list(HealthCheck))  # a busy machine is slow
@given(st.dictionaries(st.text(), VALUES), st.dictionaries(st.text(), VALUES))
def test_attributes_are_again_what_they_were(before, after):
    part, wanted = Part(), repr(before)
    vars(part).update(before)  # any name, "self" too
    state = HeldState([part])
    for value in before.values():
        if isinstance(value, list):
            value.append(1)
        if isinstance(value, dict):
            value["more"] = 1
    vars(part).update(after)
    for _ in range(2):
        state.recall()
        assert repr(vars(part)) == wanted
        vars(part).clear()


def test_whoever_knows_an_object_knows_it_still():
    inner, items = Part(x=1), [1, 2]
    outer = Part(inner=inner, items=items, again=items)
    state = HeldState([outer])
    outer.inner, outer.items, inner.x = None, [], 2
    items.clear()
    state.recall()
    assert outer.inner is inner and inner.x == 1
    assert outer.items is outer.again is items and items == [1, 2]


def test_containers_of_every_kind_keep_their_order_and_limits():
    part = Part(
        queue=deque([1, 2], maxlen=2), names={"b": 1, "a": 2}, seen={1, 2}, array=np.arange(3.0),
        pair=Pair([1], {"x": [2]}), slotted=Slotted(3), frozen=Frozen([1]),
    )  # fmt: skip
    state = HeldState([part])
    part.queue.append(3)
    part.names["b"] = part.names.pop("b") + 1
    part.seen.add(3)
    part.array[:] = 7.0
    part.pair.first.append(5)
    part.pair.second["x"].clear()
    part.slotted.grow()
    part.frozen.items.append(2)
    state.recall()
    assert list(part.queue) == [1, 2] and part.queue.maxlen == 2
    assert list(part.names.items()) == [("b", 1), ("a", 2)]
    assert part.seen == {1, 2} and part.array.tolist() == [0.0, 1.0, 2.0]
    assert part.pair == ([1], {"x": [2]}) and part.frozen.items == [1]
    assert part.slotted.size == part.slotted.hidden() == 3


def test_what_functions_refer_to_counts():
    count, part = 0, Part(x=0, log=[])

    def step(by):
        nonlocal count
        count += by
        part.x += by

    state = HeldState([partial(step, 2), part.log.append])
    step(1)
    part.log.append("!")
    state.recall()
    assert (count, part.x, part.log) == (0, 0, [])


GENERATORS = [np.random.default_rng(1), random.Random(1), np.random.RandomState(1)]


@pytest.mark.parametrize("generator", GENERATORS, ids=lambda each: type(each).__name__)
def test_random_numbers_come_again(generator):
    part = Part(generator=generator)
    state = HeldState([part])
    drawn = [generator.random() for _ in range(5)]
    state.recall()
    assert [generator.random() for _ in range(5)] == drawn


def test_a_generator_spawns_the_same_again():
    generator = np.random.default_rng(np.random.SeedSequence(1, spawn_key=(2,), pool_size=8))
    generator.spawn(1)
    state = HeldState([generator])
    spawned = [each.random() for _ in range(2) for each in generator.spawn(2)]
    for _ in range(2):
        state.recall()
        assert [each.random() for _ in range(2) for each in generator.spawn(2)] == spawned


def test_an_object_may_say_itself_what_counts():
    class Own:
        def __init__(self):
            self.file, self.x = io.StringIO(), 1

        def save_state(self):
            return self.x

        def restore_state(self, state):
            self.x = state

    own = Own()
    state = HeldState([Part(own=own)])
    own.x, own.file = 2, None
    state.recall()
    assert own.x == 1 and own.file is None


def test_an_objects_own_fault_is_named_and_the_rest_comes_back():
    class Faulty:
        def save_state(self):
            return 1

        def restore_state(self, state):
            raise ValueError("no")

    class Other(Faulty):
        def save_state(self, path):
            """Means something else by the name."""

    part, after = Part(faulty=Faulty(), x=1), Part(x=1)
    state = HeldState([part, after])
    part.x = after.x = 2
    with pytest.raises(UnknownState, match="restore_state.*Faulty.*no"):
        state.recall()
    assert part.x == after.x == 1
    with pytest.raises(UnknownState, match="Part.inner.*save_state"):
        HeldState([Part(inner=Other())])


def test_attributes_of_the_present_stay():
    class Listening:
        of_the_present = ("heard",)

        def __init__(self):
            self.heard, self.x = False, 1

    part = Listening()
    state = HeldState([part])
    part.heard, part.x = True, 2
    state.recall()
    assert part.heard and part.x == 1


def test_locks_and_circles_are_no_obstacle():
    part = Part(lock=threading.Lock(), event=threading.Event(), x=1)
    part.itself = [part]
    state = HeldState([part])
    part.x = 2
    state.recall()
    assert part.x == 1


def test_what_cannot_be_read_is_named_with_its_holder():
    class Samples(array.array):
        """Has attributes, and numbers that aren't among them."""

    for odd, name in (
        ((each for each in "abc"), "generator"), (io.StringIO(), "StringIO"),
        (array.array("d"), "array"), (Samples("d"), "Samples"),
    ):  # fmt: skip
        with pytest.raises(UnknownState, match=f"Part.item.*{name}"):
            HeldState([Part(inner=Part(item=odd))])


def test_in_a_circle_of_lists_it_is_named_by_its_type():
    first, second = [], [(each for each in "abc")]
    first.append(second)
    second.append(first)
    with pytest.raises(UnknownState, match="generator"):
        HeldState([first])


def test_subclasses_of_containers_count_wholly():
    names = OrderedDict(a=1, b=2)
    counts = Counter("aab")
    many = defaultdict(list, x=[1])
    state = HeldState([names, counts, many])
    names.move_to_end("a")
    counts.update("bbb")
    many["y"].append(1)
    many["x"].append(2)
    state.recall()
    assert list(names) == ["a", "b"]
    assert counts == Counter("aab") and many == {"x": [1]} and many["z"] == []


def test_what_came_later_goes():
    class Listening:
        of_the_present = ("heard",)

    slotted, listening = Slotted(1), Listening()
    state = HeldState([slotted, listening])
    slotted.unset, listening.later, listening.heard = 1, 1, True
    state.recall()
    assert not hasattr(slotted, "unset")
    assert vars(listening) == {"heard": True}


def test_a_set_is_gone_through_in_the_same_order():
    draw = random.Random(0)
    for _ in range(100):
        numbers = set()
        for number in draw.choices(range(60), k=40):
            draw.choice((numbers.add, numbers.add, numbers.discard))(number)
        state = HeldState([numbers])
        order = list(numbers)
        numbers.add(-1)
        state.recall()
        assert list(numbers) == order


def test_a_queue_that_delays_counts():
    late = queue.Queue()
    late.put(1)
    state = HeldState([late])
    late.get()
    state.recall()
    assert late.get_nowait() == 1


def test_random_numbers_without_a_state_are_refused():
    with pytest.raises(UnknownState, match="SystemRandom"):
        HeldState([random.SystemRandom()])
