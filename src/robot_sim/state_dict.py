"""State dictionaries of controllers, sensors, plugins and tasks: plain data by name.

Whatever lives through ticks has the pair that PyTorch's modules have:

    state_dict()            returns it
    load_state_dict(state)  takes it back

A class without them is saved by its attributes: numbers, texts, bytes, NumPy arrays, random generators,
objects with the two methods, and lists, tuples, deques, dictionaries and data classes of these. Attributes
that its class, or one that it is derived from, names as `non_persistent` are left as they are:

    non_persistent = ("publisher",)
"""

import contextlib
import dataclasses
import sys
from collections import defaultdict, deque
from collections.abc import Hashable, Iterable, Iterator, Mapping
from contextvars import ContextVar
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from robot_sim.generators import KIND, is_generator, put_generator, saved_generator

NUMBERS_AND_TEXTS = "biufcSU"  # kinds of arrays
SOURCES = f"{Path(__file__).parents[1]}/"  # of this library and those on top of it
ATOMS = frozenset((type(None), bool, int, float, str, bytes))

# Objects that loads within `undoable` have changed, with the attributes that they had.
_CHANGED: ContextVar[list[tuple[Any, dict[str, Any]]] | None] = ContextVar("_CHANGED", default=None)
Taken = dict[int, tuple[Any, Any]]
"""Objects and generators that a load has given a state, each with that state, by their id."""


class StateError(TypeError):
    """A state can't be saved, or put back; the text names the class, and the attribute."""


class Stateful:
    """Has the two methods, by its attributes."""

    __slots__ = ()
    non_persistent: ClassVar[tuple[str, ...]] = ()

    def state_dict(self) -> Any:
        """Returns what decides its future, as plain data."""
        return attributes_of(self)

    def load_state_dict(self, state: Any) -> None:
        """Takes back what `state_dict` has returned."""
        put_attributes(self, state)


class Shared:
    """Has no state, or one that its owner saves: others that refer to it don't."""

    __slots__ = ()

    @property
    def identity(self) -> str:
        """What tells it from others of its class that may come to stand in its place."""
        return ""


class Held(NamedTuple):
    """The state of an object among plain data: it goes to the one that is in the same place."""

    kind: str
    state: Any
    identity: str = ""


def state_of(part: Any) -> Any:
    """Returns the state of an object: by its own methods, or else by its attributes.

    Raises:
        StateError: If it can't be saved.
    """
    kind = type(part)
    method = getattr(kind, "state_dict", None)
    if is_generator(part):
        return _saved_as(part, kind, "state")
    if method is None or not hasattr(kind, "load_state_dict"):
        return {} if isinstance(part, Shared) else attributes_of(part)
    if method is Stateful.state_dict:
        return attributes_of(part)
    try:
        state = method(part)
    except StateError:
        raise
    except Exception as error:  # a user's code
        raise StateError(f"state_dict() of {kind.__qualname__} raised {error!r:.300}") from error
    return _saved_as(state, kind, "state_dict()")


def load(parts: Iterable[tuple[Any, Any]]) -> None:
    """Puts states back into their objects, into all of them.

    Raises:
        StateError: If one can't take its state.
    """
    faults = []
    taken: Taken = {}
    for part, state in parts:
        try:
            takes = getattr(type(part), "load_state_dict", None)
            if takes is Stateful.load_state_dict:
                put_attributes(part, state, taken)
            elif takes is not None:
                part.load_state_dict(_saved(state))  # a copy: it may keep what it gets
            elif is_generator(part):
                if _loaded_generator(part, state, taken) is not part:
                    raise StateError(f"a generator takes no state of the kind {state[KIND]}")
            elif not isinstance(part, Shared):
                put_attributes(part, state, taken)
        except StateError as error:
            faults.append(str(error))
        except Exception as error:  # noqa: BLE001 - a user's code
            faults.append(f"load_state_dict() of {type(part).__qualname__} raised {error!r:.300}")
    if faults:
        raise StateError("; ".join(faults))


@contextlib.contextmanager
def undoable() -> Iterator[None]:
    """Gives objects back the attributes that they had, other objects too, where a load within it fails."""
    changed = [] if (outer := _CHANGED.get()) is None else outer
    token = _CHANGED.set(changed)
    try:
        yield
    except BaseException:
        for part, held in reversed(changed):
            for name, value in held.items():
                object.__setattr__(part, name, value)
        raise
    finally:
        _CHANGED.reset(token)


@cache
def _layout(kind: Hashable) -> tuple[tuple[str, ...], frozenset[str], bool]:
    """Returns a class's slots, names of attributes that are left as they are, and whether it is supplied."""
    slots: list[str] = []
    left: set[str] = set()
    for each in kind.__mro__:  # type: ignore[attr-defined]
        own = vars(each).get("__slots__", ())
        for name in (own,) if isinstance(own, str) else own:
            hidden = name.startswith("__") and not name.endswith("__")
            slots.append(f"_{each.__name__.lstrip('_')}{name}" if hidden else name)
        left.update(vars(each).get("non_persistent", ()))
    saved = tuple(n for n in slots if n not in left | {"__dict__", "__weakref__"})
    return saved, frozenset(left), is_supplied(kind)


def attributes_of(part: Any) -> dict[str, Any]:
    """Returns the state of an object by its attributes.

    Raises:
        StateError: If one can't be saved.
    """
    kind: Any = type(part)
    slots, left, supplied = _layout(kind)
    state: dict[str, Any] = {}
    held = {name: getattr(part, name) for name in slots if hasattr(part, name)} if slots else {}
    if hasattr(part, "__dict__"):
        held = {**held, **part.__dict__} if held else part.__dict__
    for name, value in held.items():
        if name in left:
            continue
        if type(value) in ATOMS:
            state[name] = value
        elif not isinstance(value, Shared) or (value.identity and not supplied):
            state[name] = _saved_as(value, kind, name)
    return state


def put_attributes(part: Any, state: Mapping[str, Any], taken: Taken | None = None) -> None:
    """Gives an object what `attributes_of` has returned; what has come since goes. `taken`: see `Taken`."""
    kind: Any = type(part)
    slots, left, supplied = _layout(kind)
    own = getattr(part, "__dict__", {})
    held = {**own, **{name: getattr(part, name, None) for name in slots}} if slots else own
    if (changed := _CHANGED.get()) is not None:
        changed.append((part, {**held}))
    faults = []
    for name, saved in state.items():
        value = saved
        if changed is not None and (name in left or (supplied and isinstance(held.get(name), Shared))):
            faults.append(f"{kind.__qualname__}.{name} is no state")  # forged: it is never saved
            continue
        if type(saved) in ATOMS:
            if name in own:  # most are
                own[name] = saved
                continue
        else:
            try:
                value = _loaded(held.get(name), saved, taken)
            except StateError as error:  # the rest is put back
                faults.append(f"{kind.__qualname__}.{name}: {error}")
                continue
        if name not in held and callable(getattr(kind, name, None)):
            faults.append(f"{kind.__qualname__}.{name} is a method")
        elif name in slots:
            object.__setattr__(part, name, value)
        else:
            own[name] = value
    for name in [each for each in held if each not in state and each not in left]:
        if isinstance(held[name], Shared):
            continue
        if name in own:
            del own[name]
        elif hasattr(part, name):
            object.__delattr__(part, name)
    if faults:
        raise StateError("; ".join(faults))


def _saved_as(value: Any, kind: type, name: str) -> Any:
    try:
        return _saved(value)
    except _Unknown as error:
        raise StateError(
            f"{kind.__qualname__}.{name}: a snapshot can't save {error}; keep it in an object of its own "
            "with state_dict() and load_state_dict(), or name the attribute in `non_persistent`"
        ) from None
    except RecursionError:
        raise StateError(f"{kind.__qualname__}.{name} refers to itself") from None


class _Unknown(TypeError):
    """Names what can't be saved."""


def _saved(value: Any) -> Any:
    kind: Any = type(value)
    if kind in ATOMS:
        return value
    if kind is list:
        return [_saved(each) for each in value]
    if kind is tuple:
        return tuple([_saved(each) for each in value])
    if kind is dict or kind is defaultdict:
        return {plain_key(key): _saved(each) for key, each in value.items()}
    if kind is deque:
        return deque(map(_saved, value), value.maxlen)
    if isinstance(value, dict) and not hasattr(value, "__dict__"):  # one with other texts
        entries: dict[Any, Any] = dict.__new__(kind)
        dict.update(entries, {plain_key(key): _saved(each) for key, each in value.items()})
        return entries
    if kind is np.ndarray and value.dtype.kind in NUMBERS_AND_TEXTS:
        copied = value.copy(order="K")
        copied.setflags(write=value.flags.writeable)
        return copied
    if isinstance(value, np.generic) and value.dtype.kind in NUMBERS_AND_TEXTS:
        return value
    if isinstance(value, Shared):
        return Held(kind.__qualname__, None, value.identity)
    if is_generator(value):
        try:
            return saved_generator(value)
        except ValueError as error:
            raise _Unknown(str(error)) from None
    if hasattr(kind, "state_dict") and hasattr(kind, "load_state_dict"):
        return Held(kind.__qualname__, state_of(value))
    if isinstance(value, tuple) and hasattr(kind, "_fields"):
        return record_of(kind, map(_saved, value))
    if hasattr(kind, "__dataclass_fields__"):
        names = fields_of(kind)
        held = {name: getattr(value, name) for name in names if hasattr(value, name)}
        besides = not held.keys() >= getattr(value, "__dict__", {}).keys()
        if len(held) < len(names) or besides or isinstance(value, (list, dict, set)):
            raise _Unknown(f"a {kind.__module__}.{kind.__qualname__} whose attributes aren't its fields")
        if kind.__dataclass_params__.frozen and ATOMS.issuperset(map(type, held.values())):
            return value
        for name, each in held.items():
            try:
                held[name] = _saved(each)
            except _Unknown as error:
                raise _Unknown(f"{error} in {kind.__qualname__}.{name}") from None
        return record_of(kind, held.values())
    of = f" of {value.dtype}" if kind is np.ndarray else ""
    raise _Unknown(f"a {kind.__module__}.{kind.__qualname__}{of}")


def module_of(kind: type) -> str:
    """Returns the module that a class is from: a script's is the same in a process that it spawns."""
    return "__main__" if kind.__module__ == "__mp_main__" else kind.__module__


def is_supplied(kind: Any) -> bool:
    """Returns whether a class comes along, and isn't a user's, which may hold anything."""
    module = sys.modules.get(kind.__module__)
    return (getattr(module, "__file__", None) or "").startswith(SOURCES)


def fields_of(kind: Any) -> tuple[str, ...]:
    """Returns the names of a data class's fields."""
    return tuple([each.name for each in dataclasses.fields(kind)])


def record_of(kind: Any, values: Iterable[Any]) -> Any:
    """Returns a named tuple or data class of its fields' values; no code of the class runs."""
    if issubclass(kind, tuple):
        return tuple.__new__(kind, values)
    made = object.__new__(kind)
    for name, value in zip(fields_of(kind), values, strict=True):
        object.__setattr__(made, name, value)
    return made


def plain_key(key: Any) -> Any:
    """Returns a dictionary's key, if it is plain data."""
    if type(key) is tuple:
        return tuple([plain_key(each) for each in key])
    if type(key) not in ATOMS:
        raise _Unknown(f"a dictionary with a {type(key).__qualname__} as key")
    return key


def _nothing(part: Any, state: Any) -> None:
    """Loads nothing: the owner of shared state loads it."""


@cache
def _takes(kind: Hashable) -> Any:
    """Returns how objects of a class take states back; None for plain data."""
    return _nothing if issubclass(kind, Shared) else getattr(kind, "load_state_dict", None)  # type: ignore[arg-type]


def _loaded(current: Any, saved: Any, taken: Taken | None) -> Any:
    """Returns the saved value, with the current one's objects kept and loaded in place."""
    kind: Any = type(saved)
    if kind in ATOMS:
        return saved
    if kind is Held:
        own: Any = type(current)
        if own.__qualname__ != saved.kind or (takes := _takes(own)) is None:
            raise StateError(f"there is no {saved.kind:.100} here to take the state of one")
        if takes is _nothing and current.identity != saved.identity:
            raise StateError(
                f"it refers to '{current.identity}', and to {saved.identity!r:.100} in the snapshot"
            )
        if takes is not _nothing and _has_taken(current, saved.state, taken):
            raise StateError(f"this {saved.kind:.100} is in two places, with another state in each")
        if takes is Stateful.load_state_dict:
            put_attributes(current, saved.state, taken)
        elif takes is not _nothing:
            load([(current, saved.state)])
        return current
    if kind is list or kind is tuple:
        there = current if isinstance(current, (list, tuple)) else ()
        return kind([_loaded(each, own, taken) for own, each in zip_longest(saved, there[: len(saved)])])
    if kind is dict:
        if KIND in saved:
            return _loaded_generator(current, saved, taken)
        known = current if type(current) in (dict, defaultdict) else {}
        entries = {key: _loaded(known.get(key), each, taken) for key, each in saved.items()}
        if type(current) is defaultdict:
            return defaultdict(current.default_factory, entries)
        return entries
    if kind is deque:
        there = [*current] if isinstance(current, deque) else ()
        return deque(_loaded(there, [*saved], taken), saved.maxlen)
    names = getattr(kind, "_fields", None) or (hasattr(kind, "__dataclass_fields__") and fields_of(kind))
    if not names:
        return _saved(saved)
    values = [_loaded(getattr(current, name, None), getattr(saved, name), taken) for name in names]
    return record_of(kind, values)


def _loaded_generator(current: Any, saved: Mapping[str, Any], taken: Taken | None) -> Any:
    """Returns a generator with a saved state: a new one if the current one has taken another state."""
    if is_generator(current) and _has_taken(current, saved, taken):
        current = None
    try:
        return put_generator(current, saved)
    except ValueError as error:
        raise StateError(str(error)) from None


def _has_taken(part: Any, state: Any, taken: Taken | None) -> bool:
    """Returns whether an object has taken another state; otherwise it takes this one."""
    return taken is not None and not _alike(taken.setdefault(id(part), (part, state))[1], state)


def _alike(one: Any, other: Any) -> bool:
    if one is other:
        return True
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_alike(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple, deque)) and isinstance(other, (list, tuple, deque)):
        return len(one) == len(other) and all(map(_alike, one, other))
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return one.shape == other.shape and one.tobytes() == other.tobytes()
    return repr(one) == repr(other)  # so is NaN
