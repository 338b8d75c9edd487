"""The ranges that `sweep` searches, from YAML.

learning_rate: {low: 1.0e-4, high: 1.0e-2, log: true}
n_step: {low: 1, high: 5}                  # whole numbers, since both ends are
hidden_sizes: {choices: ["64,64", "128,128"]}
"""

from pathlib import Path
from typing import Any, NamedTuple

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import unknown
from rl_workbench.training.options import default_file, read_section, section_names

CONFIG = "sweep.yaml"
KEYS = ("low", "high", "log", "choices")


class Range(NamedTuple):
    """What one option may be: from low to high, or one of the choices."""

    low: float | int
    high: float | int
    log: bool
    choices: tuple[Any, ...]

    def suggest(self, trial: Any, name: str) -> Any:
        """A value that Optuna's trial picks."""
        if self.choices:
            return trial.suggest_categorical(name, self.choices)
        if isinstance(self.low, int) and isinstance(self.high, int):
            return trial.suggest_int(name, self.low, self.high, log=self.log)
        return trial.suggest_float(name, self.low, self.high, log=self.log)


def read_ranges(
    path: Path | None, algorithm: str, env_id: str, known: list[str]
) -> dict[str, Range]:
    """The section of algorithm and environment, or else that of the algorithm.

    Raises:
        WorkbenchError: if there is none, it names an unknown option, or a range is none.
    """
    origin = path or default_file(CONFIG)
    names = section_names(f"{algorithm} {{env_id}}", env_id)
    section = read_section(origin, (*names, algorithm), None)
    if not section:
        raise WorkbenchError(f"{origin} has no section {algorithm!r} nor {names[-1]!r}")
    for name in section:
        if name not in known:
            raise WorkbenchError(f"{origin}: {unknown('option', str(name), known)}")
    return {name: _range(value, f"{origin}: {name}") for name, value in section.items()}


def _range(value: Any, origin: str) -> Range:
    if not isinstance(value, dict) or not value:
        raise WorkbenchError(f"{origin} needs low and high, or choices, not {value!r}")
    for key in value:
        if key not in KEYS:
            raise WorkbenchError(f"{origin}: {unknown('key', str(key), list(KEYS))}")
    choices = value.get("choices")
    if choices is not None:
        return _choices(choices, origin)
    low: Any = value.get("low")
    high: Any = value.get("high")
    if not _is_number(low) or not _is_number(high) or low > high:
        raise WorkbenchError(f"{origin} needs numbers low <= high, not {low!r} and {high!r}")
    log = bool(value.get("log", False))
    if log and low <= 0:
        raise WorkbenchError(f"{origin}: a range by its logarithm begins above 0, not at {low!r}")
    return Range(low, high, log, ())


def _choices(choices: Any, origin: str) -> Range:
    if not isinstance(choices, list) or not choices:
        raise WorkbenchError(f"{origin}: choices are a list, not {choices!r}")
    if any(isinstance(each, list | dict) for each in choices):
        raise WorkbenchError(
            f'{origin}: choices are single values; sizes are a text, as in "64,64"'
        )
    return Range(0, 0, False, tuple(choices))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
