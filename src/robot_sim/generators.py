"""Random generators' states as plain data: Python's, NumPy's and torch's."""

import random
from collections.abc import Mapping
from typing import Any

import numpy as np

KIND = "__generator__"  # the key of a generator's kind in its state
BIT_GENERATORS = ("PCG64", "PCG64DXSM", "Philox", "SFC64", "MT19937")
LARGEST_POOL = 1024  # of a seed sequence; NumPy's has 4


def is_generator(value: Any) -> bool:
    return isinstance(value, (np.random.Generator, random.Random)) or _is_torchs(value)


def _is_torchs(value: Any) -> bool:
    kind = type(value)
    return kind.__name__ == "Generator" and kind.__module__.partition(".")[0] == "torch"


def saved_generator(value: Any) -> dict[str, Any]:
    """Returns a generator's state.

    Raises:
        ValueError: If it is of a type that can't be saved.
    """
    if isinstance(value, random.Random) and not isinstance(value, random.SystemRandom):
        return {KIND: "Random", "state": value.getstate()}
    if _is_torchs(value):
        return {KIND: "torch", "state": value.get_state().numpy().copy()}
    bits = getattr(value, "bit_generator", value)
    kind = type(bits).__name__
    if kind not in BIT_GENERATORS:
        raise ValueError(f"a generator of type {kind}")
    return {KIND: kind, "state": bits.state, "seeds": _seeds(bits)}


def _seeds(bits: Any) -> list[Any] | None:
    """Returns what a generator spawns others from."""
    seeds = bits.seed_seq
    if type(seeds) is not np.random.SeedSequence:
        return None
    return [seeds.entropy, seeds.spawn_key, seeds.pool_size, seeds.n_children_spawned]


def put_generator(current: Any, saved: Mapping[str, Any]) -> Any:
    """Gives the current generator a saved state, or a new one if their kinds differ; returns it.

    Raises:
        ValueError: If it can't take the state.
    """
    kind, state = saved[KIND], saved["state"]
    if kind == "torch":
        if not _is_torchs(current):
            raise ValueError("there is no torch.Generator for the state of one")
        numbers = current.get_state()
        numbers.numpy()[:] = state
        current.set_state(numbers)
        return current
    target: Any
    if kind == "Random":
        target = current if isinstance(current, random.Random) else random.Random()
        target.setstate(state)
        return target
    if kind not in BIT_GENERATORS:
        raise ValueError(f"there is no generator of type {kind!r:.100}")
    is_same = isinstance(current, np.random.Generator) and type(current.bit_generator).__name__ == kind
    target = current if is_same else np.random.Generator(getattr(np.random, kind)())
    bits: Any = target.bit_generator
    seeds = saved["seeds"]
    if seeds is None or seeds == _seeds(bits):
        bits.state = checked_bits(state)
        return target
    entropy, spawn_key, pool_size, spawned = seeds
    if pool_size > LARGEST_POOL or len(spawn_key) > LARGEST_POOL:
        raise ValueError(f"there is no seed sequence with a pool of {pool_size} and {len(spawn_key)} parents")
    again = np.random.SeedSequence(
        entropy, spawn_key=spawn_key, pool_size=pool_size, n_children_spawned=spawned
    )
    bits.__setstate__((checked_bits(state), again))
    return target


def checked_bits(state: Mapping[str, Any]) -> Mapping[str, Any]:
    """Checks a bit generator's position in its buffers, which NumPy doesn't; returns the state.

    Raises:
        ValueError: If a position lies outside of its buffer.
    """
    places = (state["state"].get("pos", 0), 624), (state.get("buffer_pos", 0), 4)
    if all(0 <= place <= count for place, count in places):
        return state
    raise ValueError("the generator's position lies outside of its numbers")
