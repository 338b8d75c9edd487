"""MessagePack of plain data: numbers, texts, bytes, NumPy arrays, and containers and records of these.

Records are named tuples and data classes, written with their class's name and their fields. Reading imports
nothing and runs no code of theirs: what this process doesn't know stays a `Record`. What is read has at most
`MOST` entries, and is nested at most `DEEPEST` times.
"""

import math
import re
import sys
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import msgpack
import numpy as np

from robot_sim.state_dict import (
    ATOMS,
    NUMBERS_AND_TEXTS,
    Held,
    StateError,
    fields_of,
    module_of,
    plain_key,
    record_of,
)

DEEPEST = 100
MOST = 2**22  # entries of lists and dictionaries, those of records and arrays included
OF_A_DEQUE = 16  # entries that an empty one counts as; it takes 760 bytes
MOST_COPIED, TIMES = 2**24, 8  # [bytes], and of all bytes: what extensions within others may copy
ALIKE = 100  # keys of a dictionary with the same hash: finding one takes longer with each
TUPLE, ARRAY, SCALAR, RECORD, DEQUE, INTEGER = range(1, 7)  # codes of MessagePack's extensions
# Attributes that may be None for a while.
OPTIONAL = frozenset(
    ("_angles", "_before", "_clock", "_goal", "_kept", "_last", "_newest", "_seen", "_waited")
    + ("gravity", "initial", "net", "steps", "value", "waited")
)
LARGEST = 2**63  # what counts nanoseconds stays below
LONGEST_INTEGER = 256  # [bytes]; states of generators have 16 to 64


class Difference(NamedTuple):
    """Where two states differ."""

    place: str  # keys and indices, with slashes
    first: Any
    second: Any

    def __str__(self) -> str:
        return f"{self.place}: {self.first!r:.80} and {self.second!r:.80}"


class Record(NamedTuple):
    """A record whose class this process hasn't imported."""

    module: str
    name: str
    fields: Any


def pack(value: Any) -> bytes:
    """Returns the bytes of plain data.

    Raises:
        StateError: If something isn't plain data.
    """
    _check_depth(value)
    try:
        return _pack(value)
    except (ValueError, OverflowError) as error:  # half a character of a text
        raise StateError(f"it can't be written: {error}") from error


def unpack(data: bytes) -> Any:
    """Returns the plain data of bytes that `pack` has returned.

    Raises:
        StateError: If they are damaged, or refer to a class that isn't imported.
    """
    value = _unpack(data, 0, Counter(room=max(MOST_COPIED, TIMES * len(data))))
    _check_depth(value)
    return value


def resolve(value: Any) -> Any:
    """Returns the same plain data, with the records of classes that have been imported since.

    Raises:
        StateError: If a class is still unknown.
    """
    resolved = unpack(pack(value))
    for entry in entries_of(resolved):
        if isinstance(entry, Record):
            raise StateError(f"there is no class {f'{entry.module}.{entry.name}'!r:.300}")
    return resolved


def entries_of(value: Any) -> Iterator[Any]:
    """Yields a value and all that is in it, level by level.

    Raises:
        StateError: If it is nested too deeply.
    """
    level = [value]
    for _ in range(DEEPEST):
        yield from level
        level = [entry for container in level for entry in _within(container)]
        if not level:
            return
    raise StateError("it is nested too deeply")


def _check_depth(value: Any) -> None:
    for _ in entries_of(value):  # raises
        pass


def _within(value: Any) -> Iterable[Any]:
    kind = type(value)
    if kind in ATOMS:
        return ()
    if isinstance(value, dict):
        return value.values()
    if isinstance(value, (list, tuple, deque)):
        return value
    fields = fields_of(kind) if hasattr(kind, "__dataclass_fields__") else ()
    return [getattr(value, name) for name in fields]


def _pack(value: Any) -> bytes:
    return bytes(msgpack.packb(value, default=_extension, strict_types=True))


def _extension(value: Any) -> msgpack.ExtType:
    kind: Any = type(value)
    if kind is tuple:
        return msgpack.ExtType(TUPLE, _pack(list(value)))
    if kind is np.ndarray:
        _dtype(value.dtype.str)
        order = "F" if value.flags.f_contiguous and not value.flags.c_contiguous else "C"
        numbers = value.tobytes(order)
        content = [value.dtype.str, list(value.shape), value.flags.writeable, numbers]
        return msgpack.ExtType(ARRAY, _pack(content + ["F"] * (order == "F")))
    if isinstance(value, np.generic):
        _dtype(value.dtype.str)
        return msgpack.ExtType(SCALAR, _pack([value.dtype.str, value.tobytes()]))
    if kind is int:
        size = value.bit_length() // 8 + 1
        if size > LONGEST_INTEGER:
            raise StateError(f"it has an integer of {size} bytes")
        return msgpack.ExtType(INTEGER, value.to_bytes(size, "little", signed=True))
    if kind is deque:
        return msgpack.ExtType(DEQUE, _pack([value.maxlen, list(value)]))
    if kind is Record:
        return msgpack.ExtType(RECORD, _pack(list(value)))
    if isinstance(value, dict):
        fields: Any = dict(value)
    elif hasattr(kind, "_fields"):
        fields = list(value)
    elif hasattr(kind, "__dataclass_fields__"):
        fields = [getattr(value, name) for name in fields_of(kind)]
    else:
        raise StateError(f"a {kind.__qualname__} isn't plain data")
    if _class_of(module_of(kind), kind.__qualname__) is not kind:
        raise StateError(f"a {kind.__module__}.{kind.__qualname__} couldn't be found again by this name")
    return msgpack.ExtType(RECORD, _pack([module_of(kind), kind.__qualname__, fields]))


def _unpack(data: bytes, depth: int, count: Counter[str]) -> Any:
    if depth > DEEPEST:
        raise StateError("it is nested too deeply")

    longest = min(MOST, len(data))  # lists are made as long as they say

    def counted(entries: list[Any], besides: int = 0) -> list[Any]:
        count["entries"] += len(entries) + besides
        if count["entries"] > MOST:
            raise StateError(f"it has more than {MOST} entries")
        return entries

    def dictionary(pairs: list[Any]) -> dict[Any, Any]:
        keys = [plain_key(key) for key, _ in counted(pairs)]
        if len(keys) > ALIKE:
            hashes = Counter(map(hash, keys))
            if max(hashes.values()) > ALIKE:
                raise StateError("it has a dictionary whose keys are too much alike")
        return dict(pairs)

    def extension(code: int, content: bytes) -> Any:
        if code == INTEGER and len(content) <= LONGEST_INTEGER:
            return int.from_bytes(content, "little", signed=True)
        count["room"] -= len(content)
        if count["room"] < 0:
            raise StateError("it has too much in extensions within others")
        given = _unpack(content, depth + 1, count)
        if code == TUPLE:
            return tuple(given)
        if code == ARRAY:
            dtype, shape, is_writeable, numbers, *order = given
            memory: Any = bytearray(memoryview(numbers)) if is_writeable else numbers
            flat = np.frombuffer(memory, _dtype(dtype))
            return flat.reshape(shape, order="F" if order == ["F"] else "C")
        if code == SCALAR:
            dtype, number = given
            kind = _dtype(dtype)
            return np.frombuffer(number, kind, 1)[0] if kind.itemsize else kind.type()  # an empty text
        if code == DEQUE:
            most, entries = given
            return deque(counted(entries, OF_A_DEQUE), most)
        if code == RECORD:
            return _record(*given)
        raise StateError(f"it has an extension {code}")

    try:
        return msgpack.unpackb(
            data, ext_hook=extension, list_hook=counted, object_pairs_hook=dictionary,
            strict_map_key=False, max_array_len=longest, max_map_len=longest, timestamp=1,
        )  # fmt: skip
    except StateError:
        raise
    except (ArithmeticError, TypeError, ValueError, MemoryError, msgpack.UnpackException) as error:
        raise StateError(f"it is damaged: {error!r:.200}") from error


def _dtype(name: Any) -> np.dtype[Any]:
    if not (isinstance(name, str) and re.fullmatch(rf"[<>|][{NUMBERS_AND_TEXTS}]\d{{1,4}}", name)):
        raise StateError(f"it has an array of type {name!r:.50}")
    return np.dtype(name)


def _class_of(module: str, name: str) -> Any:
    """Returns what has that name, if its module was imported."""
    found: Any = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, "__dict__", {}).get(part)
    return found


def _record(module: Any, name: Any, fields: Any) -> Any:
    """Makes a record; no code of its class runs."""
    if not (isinstance(module, str) and isinstance(name, str)):
        raise StateError("it has a record without a class")
    kind = _class_of(module, name)
    if isinstance(kind, type) and (module_of(kind), kind.__qualname__) == (module, name):
        if kind is Record:
            raise StateError("it has a record of records")
        if issubclass(kind, dict) and isinstance(fields, dict):
            if kind.__basicsize__ != dict.__basicsize__:  # an OrderedDict has a memory of its own
                raise StateError(f"it has a wrong record of {module}.{name}"[:300])
            entries: dict[Any, Any] = dict.__new__(kind)
            dict.update(entries, fields)
            return entries
        names = getattr(kind, "_fields", ())
        if hasattr(kind, "__dataclass_fields__"):
            names = fields_of(kind)
        if names and isinstance(fields, list) and len(fields) == len(names):
            return record_of(kind, fields)
        raise StateError(f"it has a wrong record of {module}.{name}"[:300])
    return Record(module, name, fields)


def misfit(there: Any, given: Any, place: str = "", *, exactly: bool = False) -> str:
    """Returns where a state can't take the place of the one that is there, by its types; "" if it may.

    Args:
        there: The present state.
        given: The other one.
        place: Of both in a larger state.
        exactly: Whether names and lengths have to be the same, too.
    """
    there, given = (each.item() if isinstance(each, np.generic) else each for each in (there, given))
    numbers = (int, float)
    if _is_odd(given) and (isinstance(there, int) or (exactly and not _is_odd(there))):
        return f"{place} is {given}"
    if (there is None or given is None) and (there is given or place.rpartition("/")[2] in OPTIONAL):
        return ""
    if type(there) in numbers and type(given) in numbers:
        counts = isinstance(given, int) and abs(there) < LARGEST  # generators have larger numbers
        return f"{place} is {given}" if counts and abs(given) >= LARGEST else ""
    both = type(there), type(given)
    if both[0] is not both[1] and set(both) != {list, tuple}:
        return f"{place} is a {type(given).__name__}, not a {type(there).__name__}"
    if isinstance(there, np.ndarray):
        sizes = [each.shape if exactly else each.ndim for each in (there, given)]
        if there.dtype != given.dtype or sizes[0] != sizes[1]:
            return f"{place} is an array of {given.dtype}{list(given.shape)}"
    if exactly and isinstance(there, (dict, list, tuple)):
        keys, others = (each if isinstance(each, dict) else range(len(each)) for each in (there, given))
        if set(keys) != set(others):
            return f"{place} has {list(others)!s:.200}, not {list(keys)!s:.200}"
    own, other = (each.state if isinstance(each, Held) else None for each in (there, given))
    if isinstance(own, dict) and isinstance(other, dict) and not own.keys() <= other.keys():
        return f"{place} lacks some of {[*own]!s:.200}"
    entries = there.items() if isinstance(there, dict) else ()
    lost = any(key not in given and _refers(each) for key, each in entries)
    if isinstance(there, (list, tuple)) and len(there) != len(given):
        are_numbers = isinstance(there, tuple) and there != () and {*map(type, there)} <= {*numbers}
        lost = are_numbers or _refers(there) or (not given and any(isinstance(each, Held) for each in there))
    if lost:
        return f"{place} lacks joints, or other parts that are here"
    pairs: Iterable[tuple[Any, Any, Any]] = ()
    if isinstance(there, dict):
        pairs = ((key, there[key], given[key]) for key in there if key in given)
    elif isinstance(there, (list, tuple)) and len(there) == len(given):
        pairs = zip(range(len(there)), there, given, strict=True)
    elif isinstance(there, deque) and there:  # of the same kind of entries, few or many
        like = there if len(there) == len(given) else [there[0]] * len(given)
        exactly, pairs = True, zip(range(len(given)), like, given, strict=True)
    elif hasattr(there, "__dataclass_fields__"):
        names = fields_of(type(there))
        pairs = ((name, getattr(there, name), getattr(given, name)) for name in names)
    found = (misfit(one, other, f"{place}/{key}".lstrip("/"), exactly=exactly) for key, one, other in pairs)
    return next(filter(None, found), "")


def _is_odd(value: Any) -> bool:
    return isinstance(value, float) and not math.isfinite(value)


def _refers(value: Any) -> bool:
    """Returns whether it refers to what others save, such as joints, which can't be found again."""
    if isinstance(value, Held):
        return value.state is None
    values = value.values() if isinstance(value, dict) else value
    return isinstance(value, (list, tuple, dict)) and any(map(_refers, values))


def is_within(value: Any, most: float) -> bool:
    """Returns whether no number of plain data is beyond `most`, or NaN."""
    if isinstance(value, (list, tuple, dict)):
        entries = value.values() if isinstance(value, dict) else value
        return all(is_within(each, most) for each in entries)
    return not isinstance(value, (int, float, np.number, np.ndarray)) or bool(np.all(np.abs(value) <= most))


def differences(first: Any, second: Any, place: str = "") -> Iterator[Difference]:
    """Yields where two states differ, in order."""
    if type(first) is not type(second):
        yield Difference(place, first, second)
    elif isinstance(first, dict):
        for key in dict.fromkeys([*first, *second]):
            yield from differences(first.get(key), second.get(key), f"{place}/{key}".lstrip("/"))
    elif isinstance(first, (list, tuple, deque)) and len(first) == len(second):
        names = getattr(first, "_fields", range(len(first)))
        for name, one, other in zip(names, first, second, strict=True):
            yield from differences(one, other, f"{place}/{name}".lstrip("/"))
    elif hasattr(first, "__dataclass_fields__"):
        for name in fields_of(type(first)):
            one, other = getattr(first, name), getattr(second, name)
            yield from differences(one, other, f"{place}/{name}".lstrip("/"))
    elif pack(first) != pack(second):  # tells -0.0 from 0.0, and finds NaN equal to itself
        yield Difference(place, first, second)
