"""Search ranges of a sweep: config/sweep.yaml, or the user's file."""

from pathlib import Path
from typing import Any, NamedTuple

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import unknown
from rl_workbench.training.options import default_file, read_section, section_names

RANGES = "sweep.yaml"  # in the package's config


class OptionRange(NamedTuple):
    """The values that the search may give an option: from low to high, or one of the choices."""

    low: float | int
    high: float | int
    log: bool
    choices: tuple[Any, ...]

    def suggest(self, trial: Any, name: str) -> Any:
        """Returns a value that Optuna's trial picks."""
        if self.choices:
            return trial.suggest_categorical(name, self.choices)
        if isinstance(self.low, int) and isinstance(self.high, int):
            return trial.suggest_int(name, self.low, self.high, log=self.log)
        return trial.suggest_float(name, self.low, self.high, log=self.log)


def read_ranges(
    path: Path | None, algorithm: str, env_id: str, known: list[str]
) -> dict[str, OptionRange]:
    """Reads the ranges for an algorithm in an environment, else those for the algorithm."""
    origin = path or default_file(RANGES)
    names = section_names(f"{algorithm} {{env_id}}", env_id)
    section = read_section(origin, (*names, algorithm), None)
    if not section:
        raise WorkbenchError(f"{origin} has no section {algorithm!r} nor {names[-1]!r}")
    for name in section:
        if name not in known:
            raise WorkbenchError(f"{origin}: {unknown('option', str(name), known)}")
    return {name: _range(value, f"{origin}: {name}") for name, value in section.items()}


def _range(value: Any, origin: str) -> OptionRange:
    if not isinstance(value, dict) or not value:
        raise WorkbenchError(f"{origin} needs low and high, or choices, not {value!r}")
    for key in value:
        if key not in OptionRange._fields:
            raise WorkbenchError(f"{origin}: {unknown('key', str(key), list(OptionRange._fields))}")
    choices = value.get("choices")
    if choices is not None:
        if not isinstance(choices, list) or not choices:
            raise WorkbenchError(f"{origin}: choices are a list, not {choices!r}")
        if any(isinstance(each, list | dict) for each in choices):
            raise WorkbenchError(
                f'{origin}: choices are single values; sizes are a text, as in "64,64"'
            )
        return OptionRange(0, 0, False, tuple(choices))
    low: Any = value.get("low")
    high: Any = value.get("high")
    log = bool(value.get("log"))
    if not {type(low), type(high)} <= {int, float} or low > high:
        raise WorkbenchError(f"{origin} needs numbers low <= high, not {low!r} and {high!r}")
    if log and low <= 0:
        raise WorkbenchError(f"{origin}: a logarithmic range begins above 0, not at {low!r}")
    return OptionRange(low, high, log, ())
