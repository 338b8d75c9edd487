"""Options that are numbers: one for all, or some by name."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from bullet_gazebo.state import did_you_mean


def is_number(value: Any) -> bool:
    """Whether it is a finite number, also one of NumPy's; True and False are none."""
    if isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except (TypeError, ValueError, OverflowError):
        return False


def by_name(
    option: str, given: Any, names: Sequence[str], kind: str, which: str = ""
) -> dict[str, Any]:
    """What is given for each of `names`, unchecked; without those that a mapping leaves out.

    Args:
        option: whose, for the error text.
        given: one for all, or a mapping by name.
        names: that there are.
        kind: what has them: "joint", "controller".
        which: which of them: "that moves".

    Raises:
        ValueError: for a name that isn't there, with the nearest one.
    """
    if not isinstance(given, Mapping):
        return dict.fromkeys(names, given)
    for name in given:
        if name not in names:
            hint = did_you_mean(str(name), names) or f"; there are {', '.join(names) or 'none'}"
            raise ValueError(f"{option}: there is no {kind} {name!r}{which and ' '}{which}{hint}")
    return dict(given)


def at_least_zero(option: str, given: Any) -> float:
    """A number that may be 0.

    Raises:
        ValueError: for anything else.
    """
    if not is_number(given) or given < 0.0:
        raise ValueError(f"{option} must be a number >= 0, not {given!r}")
    return float(given)


def steps(option: str, given: Any, most: int) -> int:
    """A number of control steps.

    Raises:
        ValueError: for anything else.
    """
    if not is_number(given) or not 0 <= given <= most or given != int(given):
        raise ValueError(
            f"{option} must be a number of control steps from 0 to {most}, not {given!r}"
        )
    return int(given)
