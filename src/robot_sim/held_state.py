"""What objects hold, with all that they reach, and how it is put back into the same objects.

Controllers, sensors, plugins and tasks keep their state in attributes. A `HeldState` copies these, and writes
the copies back in place: whoever knows an object knows it still. It looks into containers, closures and bound
methods, and at what OUTSIDE names it doesn't look. A class says itself what counts by

    save_state()            returns it
    restore_state(state)    takes it back

or names attributes that belong to the present, which are neither saved nor put back:

    of_the_present = ("_publisher",)
"""

import pathlib
import random
import re
import types
import weakref
from collections import OrderedDict, defaultdict, deque
from collections.abc import Callable, Collection, Iterable, Mapping
from datetime import date, timedelta
from decimal import Decimal
from enum import Enum
from functools import partial
from itertools import chain
from operator import attrgetter, itemgetter, methodcaller
from typing import Any

import numpy as np

# Names of classes begin with these: what threads and ROS own, what never changes while a world runs, and what
# saves its own state.
OUTSIDE = (
    "_thread.", "concurrent.", "contextlib.", "logging.", "socket.", "subprocess.", "threading.", "xml.",
    "actionlib.", "dynamic_reconfigure.", "gymnasium.", "rospy.", "tf.", "tf2_ros.",
    "robot_sim.physics.", "robot_sim.pictures.", "bullet_gazebo.common.",
    "bullet_gazebo.control.", "bullet_gazebo.journal.", "bullet_gazebo.scene.",
    "bullet_gazebo.services.", "bullet_gazebo.plugins.plugin_loader.",
    "bullet_gazebo.plugins.sensor_topics.Newcomers", "bullet_gazebo.plugins.sensor_topics.Topic",
    "robot_sim.sensors.rays.", "robot_sim.sensors.sensing.Mount",
    "robot_sim.simulator.Simulator", "robot_envs.environment.", "robot_envs.robot.",
    "robot_envs.scene.", "robot_envs.vector.",
)  # fmt: skip
VALUES = (
    type(None), bool, int, float, complex, str, bytes, range, slice, type, Enum, np.generic, np.dtype,
    types.ModuleType, types.MappingProxyType, types.EllipsisType, re.Pattern, weakref.ref, pathlib.PurePath,
    attrgetter, itemgetter, BaseException, np.ufunc, type(np.clip), type(str.lower), date, timedelta,
    Decimal,
)  # fmt: skip
ENVIRONMENT = "gymnasium.core.Env"
SPAWNED = "n_children_spawned"  # of a SeedSequence
POINTER = 8  # [bytes]; to an attribute in __slots__, or to the __dict__ of a compiled class

Put = Callable[[Any, Any], object]
Look = Callable[["HeldState", Any], Iterable[Any]]
"""Notes what an object holds, and returns what it refers to."""


class UnknownState(TypeError):
    """An object's state can't be saved; the text names its type and what holds it."""


ROOM = UnknownState.__basicsize__ - TypeError.__basicsize__
"""What a class of Python's takes for its __dict__ and weak references [bytes]: none since 3.12."""


class HeldState:
    """What objects hold at present.

    Args:
        roots: the objects; what they refer to counts, too.

    Raises:
        UnknownState: if there is something whose state can't be read, such as an open file.
    """

    def __init__(self, roots: Iterable[Any]) -> None:
        self._notes: list[tuple[Put, Any, Any]] = []  # what puts it back, where, and what
        self._own: list[tuple[Any, Any]] = []  # objects that do it themselves
        seen: dict[int, Any] = {}
        waiting = list(roots)
        while waiting:
            each = waiting.pop()
            kind = type(each)
            look = _LOOKS.get(kind) or _look_of(kind)
            if look is _nowhere or id(each) in seen:
                continue
            seen[id(each)] = each
            try:
                waiting.extend(look(self, each))
            except UnknownState as error:
                raise UnknownState(f"{_place(each, seen.values())}: {error}") from None

    def note_own(self, target: Any, held: Any) -> None:
        """Remembers to call `target.restore_state(held)`."""
        self._own.append((target, held))

    def note(self, put: Put, target: Any, held: Any) -> None:
        """Remembers to call `put(target, held)`."""
        self._notes.append((put, target, held))

    def recall(self) -> None:
        """Puts everything back; may be called again and again.

        Raises:
            UnknownState: if a class's own `restore_state` has raised; all else is put back then.
        """
        for put, target, held in self._notes:
            put(target, held)
        faults = []
        for target, held in self._own:
            try:
                target.restore_state(held)
            except Exception as error:  # noqa: BLE001 - a user's code
                faults.append(f"restore_state() of {type(target).__qualname__} raised {error!r}")
        if faults:
            raise UnknownState("; ".join(faults))


def _place(each: Any, seen: Collection[Any]) -> str:
    """Returns where an object is: Class.attribute of what has it, in containers or not."""
    for one in seen:
        names = (name for name, value in getattr(one, "__dict__", {}).items() if value is each)
        if name := next(names, None):
            return f"{type(one).__qualname__}.{name}"
    for one in seen:
        if isinstance(one, (dict, list, tuple, deque)) and _contains(one, each):
            return _place(one, [other for other in seen if other is not one])  # circles end
    return type(each).__qualname__


def _contains(container: Any, each: Any) -> bool:
    items = container.values() if isinstance(container, dict) else container
    return any(one is each for one in items)


def _nowhere(state: HeldState, each: Any) -> Iterable[Any]:
    return ()


def _into_tuple(state: HeldState, each: Iterable[Any]) -> Iterable[Any]:
    return each


def _copying(take: Callable[[Any], Any], put: Put, refers: bool = True) -> Look:
    """Returns how to look into what is saved as a whole; with `refers`, it refers to what is in it."""

    def look(state: HeldState, each: Any) -> Iterable[Any]:
        held = take(each)
        state.note(put, each, held)
        return held if refers else ()

    return look


def _put_list(target: list[Any], held: list[Any]) -> None:
    target[:] = held


def _put_deque(target: deque[Any], held: tuple[Any, ...]) -> None:
    target.clear()
    target.extend(held)


def _into_set(state: HeldState, each: set[Any]) -> Iterable[Any]:
    held = each.copy()
    _put_mutable(each, held)  # its order follows from how it was filled
    state.note(_put_mutable, each, held)
    return held


def _into_dict(state: HeldState, each: dict[Any, Any]) -> Iterable[Any]:
    held = dict(each)
    state.note(_put_mutable, each, held)
    return held.values()


def _put_mutable(target: Any, held: Any) -> None:
    target.clear()  # the order of a dictionary counts
    target.update(held)


def _into_array(state: HeldState, each: np.ndarray) -> Iterable[Any]:
    if each.flags.writeable:
        state.note(np.copyto, each, each.copy())
    return each.flat if each.dtype.hasobject else ()


def _into_generator(state: HeldState, each: np.random.Generator) -> Iterable[Any]:
    bits = each.bit_generator
    state.note(_put_generator, bits, (bits.state, getattr(bits.seed_seq, SPAWNED, None)))
    return ()


def _put_generator(target: Any, held: tuple[Any, Any]) -> None:
    numbers, spawned = held
    seeds = target.seed_seq
    if getattr(seeds, SPAWNED, None) == spawned:
        target.state = numbers
    else:
        again = np.random.SeedSequence(
            seeds.entropy, spawn_key=seeds.spawn_key, pool_size=seeds.pool_size,
            n_children_spawned=spawned,
        )  # fmt: skip
        target.__setstate__((numbers, again))


def _into_function(state: HeldState, each: types.FunctionType) -> Iterable[Any]:
    defaults = (*(each.__defaults__ or ()), *(each.__kwdefaults__ or {}).values())
    return (*(each.__closure__ or ()), *defaults)


def _into_cell(state: HeldState, each: types.CellType) -> Iterable[Any]:
    try:
        held = each.cell_contents
    except ValueError:  # nothing is assigned yet
        return ()
    state.note(_put_cell, each, held)
    return (held,)


def _put_cell(target: types.CellType, held: Any) -> None:
    target.cell_contents = held


def _into_method(state: HeldState, each: Any) -> Iterable[Any]:
    return (each.__self__,)


def _into_partial(state: HeldState, each: partial[Any]) -> Iterable[Any]:
    return (each.func, *each.args, *each.keywords.values())


def _into_own(state: HeldState, each: Any) -> Iterable[Any]:
    try:
        held = each.save_state()
    except Exception as error:  # a user's code
        raise UnknownState(f"save_state() raised {error!r:.300}") from error
    state.note_own(each, held)
    return ()


def _environment(state: HeldState, each: Any) -> Iterable[Any]:
    raise UnknownState(
        "a snapshot doesn't save an environment; name the attribute in `of_the_present` to leave it out"
    )


def _unreadable(state: HeldState, each: Any) -> Iterable[Any]:
    kind = type(each)
    name = f"{kind.__module__}.{kind.__qualname__}"
    raise UnknownState(
        f"a snapshot can't save a {name}; name the attribute in `of_the_present` to leave it out"
    )


_LOOKS: dict[type, Look] = {
    tuple: _into_tuple,
    frozenset: _into_tuple,
    list: _copying(list, _put_list),
    dict: _into_dict,
    OrderedDict: _into_dict,
    defaultdict: _into_dict,
    set: _into_set,
    deque: _copying(tuple, _put_deque),
    np.ndarray: _into_array,
    np.random.Generator: _into_generator,
    np.random.RandomState: _copying(
        methodcaller("get_state", legacy=False), np.random.RandomState.set_state, refers=False
    ),
    random.Random: _copying(methodcaller("getstate"), random.Random.setstate, refers=False),
    types.FunctionType: _into_function,
    types.CellType: _into_cell,
    types.MethodType: _into_method,
    types.BuiltinMethodType: _into_method,
    types.MethodWrapperType: _into_method,
    partial: _into_partial,
}
_BASES = (tuple, list, OrderedDict, defaultdict, dict, set, deque, np.ndarray, random.Random)


def _look_of(kind: type) -> Look:
    """Finds how to look into objects of a class, and remembers it."""
    if issubclass(kind, VALUES) or f"{kind.__module__}.{kind.__qualname__}".startswith(OUTSIDE):
        look: Look = _nowhere
    elif any(f"{base.__module__}.{base.__qualname__}" == ENVIRONMENT for base in kind.__mro__):
        look = _environment  # its save_state() would come back here
    elif issubclass(kind, random.SystemRandom):
        look = _unreadable
    elif hasattr(kind, "save_state") and hasattr(kind, "restore_state"):
        look = _into_own
    else:
        look = _look_by_attributes(kind)
    _LOOKS[kind] = look
    return look


def _look_by_attributes(kind: type) -> Look:
    known = next((each for each in _BASES if issubclass(kind, each)), object)
    slots = tuple(_slots(kind))
    pointers = len(slots) + (kind.__dictoffset__ > 0 == known.__dictoffset__)
    if kind.__basicsize__ > known.__basicsize__ + ROOM + POINTER * pointers:
        return _unreadable  # it is compiled, and holds more than attributes
    base = _LOOKS.get(known)
    has_dict = kind.__dictoffset__ != 0
    parts = [look for look in (base, _slots_look(slots) if slots else None) if look]
    if has_dict:
        parts.append(_dict_look(frozenset(getattr(kind, "of_the_present", ()))))
    if not parts:
        # A class of Python's without any attribute has an empty __slots__.
        return _nowhere if "__slots__" in vars(kind) else _unreadable
    if len(parts) == 1:
        return parts[0]
    return lambda state, each: list(chain.from_iterable(look(state, each) for look in parts))


def _slots(kind: type) -> Iterable[str]:
    for each in kind.__mro__:
        names = vars(each).get("__slots__", ())
        for name in (names,) if isinstance(names, str) else names:
            if name not in ("__dict__", "__weakref__"):
                hidden = name.startswith("__") and not name.endswith("__")
                yield f"_{each.__name__.lstrip('_')}{name}" if hidden else name


def _dict_look(present: frozenset[str]) -> Look:
    def look(state: HeldState, each: Any) -> Iterable[Any]:
        own = each.__dict__
        held = own.copy()
        for name in present:
            held.pop(name, None)
        state.note(partial(_put_others, present) if present else _put_attributes, own, held)
        return held.values()

    return look


def _put_others(present: frozenset[str], target: dict[str, Any], held: Mapping[str, Any]) -> None:
    kept = {name: target[name] for name in present & target.keys()}
    _put_attributes(target, {**held, **kept})


def _put_attributes(target: dict[str, Any], held: dict[str, Any]) -> None:
    if target.keys() != held.keys():
        target.clear()
    target.update(held)


def _slots_look(names: tuple[str, ...]) -> Look:
    def look(state: HeldState, each: Any) -> Iterable[Any]:
        held = {name: getattr(each, name) for name in names if hasattr(each, name)}
        state.note(partial(_put_slots, names), each, held)
        return held.values()

    return look


def _put_slots(names: tuple[str, ...], target: Any, held: Mapping[str, Any]) -> None:
    for name in names:
        if name in held:
            object.__setattr__(target, name, held[name])
        elif hasattr(target, name):
            object.__delattr__(target, name)
