"""Options as fields of a dataclass: default, meaning and limits in one place."""

from dataclasses import field, fields
from typing import Any

from rl_workbench.errors import WorkbenchError


def option(
    default: Any,
    text: str,
    lowest: float | None = None,
    highest: float | None = None,
    choices: tuple[str, ...] | None = None,
    metavar: str | None = None,
) -> Any:
    """A dataclass field that knows what it means and what it may be.

    Args:
        text: for `--help`.
        lowest: smallest value of a number.
        highest: largest one.
        choices: all values of a text.
        metavar: what `--help` calls its value (the end of its name).
    """
    limits = None if lowest is None or highest is None else (lowest, highest)
    metadata = {"help": text, "limits": limits, "choices": choices, "metavar": metavar}
    if isinstance(default, dict):
        return field(default_factory=default.copy, metadata=metadata)
    return field(default=default, metadata=metadata)


def check_options(instance: Any) -> None:
    """Holds every value of a dataclass of options against its limits.

    Raises:
        WorkbenchError: if one is beyond them; a number that isn't one is, too.
    """
    for each in fields(instance):
        value = getattr(instance, each.name)
        limits, choices = each.metadata.get("limits"), each.metadata.get("choices")
        if limits and value is not None and not limits[0] <= value <= limits[1]:
            raise WorkbenchError(
                f"{each.name} lies between {limits[0]:g} and {limits[1]:g}, not {value!r}"
            )
        if choices and value is not None and value not in choices:
            raise WorkbenchError(f"{each.name} is one of {', '.join(choices)}, not {value!r}")
