"""What is refused in a request before anything in the world is touched."""

import math

import genpy

LARGEST = 1e12  # in any SI unit; beyond it the engine's arithmetic ends in infinities


def bad_number(message: genpy.Message, largest: float = LARGEST) -> str:
    """Returns which number of a message no world can hold, and why; an empty text if all are sound."""
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        fault = _fault(getattr(message, name), kind, largest)
        if fault:
            return f"{name}{fault}"
    return ""


def _fault(value: object, kind: str, largest: float) -> str:
    if isinstance(value, genpy.Message):
        fault = bad_number(value, largest)
        return fault and f".{fault}"
    if isinstance(value, (list, tuple)):
        for index, item in enumerate(value):
            fault = _fault(item, kind.partition("[")[0], largest)
            if fault:
                return f"[{index}]{fault}"
    if kind in ("float32", "float64") and isinstance(value, float):
        if not math.isfinite(value):
            return f" is {value}; it must be finite"
        if abs(value) > largest:
            return f" is {value}; it can't be beyond {largest:g}"
    return ""
