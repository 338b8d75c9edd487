"""What `benchmark` trains: variants of a training, from config/benchmark.yaml or from flags."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import is_plain
from rl_workbench.training.algorithms import ALGORITHMS, algorithm
from rl_workbench.training.command_line import choose
from rl_workbench.training.options import default_file, known_options, read_section

CONFIG = "benchmark.yaml"
NAME = re.compile(r"\w[\w.+-]*")  # of a variant, which is a folder's too
MOST_SEEDS = 10_000
OWN = ("seed", "run_dir", "exp_name")  # the benchmark gives these
SEEDS = 5  # unless somebody says otherwise
KEYS = ("about", "seeds", "common", "variants")


@dataclass(frozen=True)
class Variant:
    """One way to train; every seed of it is a run."""

    name: str
    algorithm: str
    options: dict[str, Any]


@dataclass(frozen=True)
class Suite:
    """What is trained and compared."""

    name: str
    about: str
    seeds: int  # unless the user says otherwise
    variants: tuple[Variant, ...]


def read_suite(name: str, path: Path | None = None) -> Suite:
    """A suite of a file, by default of config/benchmark.yaml.

    Raises:
        WorkbenchError: if the file has no such suite, or it makes no sense.
    """
    path = path or default_file(CONFIG)
    section = read_section(path, (), name)
    unknown = [key for key in section if key not in KEYS]
    if unknown or not isinstance(section.get("variants"), dict) or not section["variants"]:
        raise WorkbenchError(f"{path}: a suite has variants, and perhaps {', '.join(KEYS[:-1])}")
    origin = f"{path}, {name}"
    common = _options(section.get("common"), f"{origin}: common")
    variants = tuple(
        make_variant(origin, str(key), {**common, **_options(own, f"{origin}: {key}")})
        for key, own in section["variants"].items()
    )
    seeds = section.get("seeds", SEEDS)
    if type(seeds) is not int or not 1 <= seeds <= MOST_SEEDS:
        raise WorkbenchError(f"{origin}: seeds is a number from 1 to {MOST_SEEDS}, not {seeds!r}")
    return Suite(name, str(section.get("about", "")), seeds, variants)


def _options(value: Any, origin: str) -> dict[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, dict) or not is_plain(value):
        raise WorkbenchError(f"{origin} has options with plain values, not {value!r}")
    return value


def make_variant(origin: str, name: str, options: dict[str, Any]) -> Variant:
    """A variant; the options of our own algorithms are checked for names and types.

    Raises:
        WorkbenchError: if there is no such algorithm or option, or the name is none for a folder;
            `origin` says where it stands.
    """
    if not NAME.fullmatch(name):
        raise WorkbenchError(
            f"{origin}: a variant's name is letters, digits, _, -, + and ., not {name!r}"
        )
    rest = dict(options)
    kind = str(rest.pop("algo", "dqn"))
    if kind not in ALGORITHMS:
        raise WorkbenchError(f"{origin}: algo is one of {', '.join(ALGORITHMS)}, not {kind!r}")
    taken = [key for key in rest if key in OWN]
    if taken:
        raise WorkbenchError(f"{origin}: {taken[0]} is given by the benchmark")
    if not algorithm(kind).package:  # the others are asked only when they are trained
        rest = {key: value for key, value in rest.items() if value is not None}
        known_options(algorithm(kind)).read(_without_special(kind, rest), f"{origin}: {name}")
    return Variant(name, kind, rest)


def check_package(variant: Variant) -> None:
    """Looks whether the package of the variant's algorithm is there, and takes the options.

    Raises:
        WorkbenchError: if not.
    """
    kind = algorithm(variant.algorithm)
    if kind.package:
        choose(kind, training_flags(variant, 0)[2:])


def _without_special(name: str, options: dict[str, Any]) -> dict[str, Any]:
    """Without the flags that are no options: which section of the algorithm's file, or which file."""
    special = ("config", *(("preset",) if algorithm(name).presets else ()))
    return {key: value for key, value in options.items() if key not in special}


def training_flags(variant: Variant, seed: int) -> list[str]:
    """What `workbench.py train` is told for one run, but for its folder."""
    rest = _without_special(variant.algorithm, variant.options)
    special = {key: value for key, value in variant.options.items() if key not in rest}
    if "config" in special:  # another machine's folders aren't this one's
        special["config"] = Path(special["config"]).resolve()
    own = {"exp_name": variant.name, "seed": seed, **special}
    flags = [f"--{key.replace('_', '-')}={value}" for key, value in own.items()]
    pairs = [f"{key}={_text(value)}" for key, value in rest.items()]
    return ["--algo", variant.algorithm, *flags, *(["--params", *pairs] if pairs else [])]


def _text(value: Any) -> str:
    """As `train` reads it, Stable-Baselines3's options as YAML."""
    if isinstance(value, list | tuple):
        return f"[{','.join(map(str, value))}]"
    if isinstance(value, dict):
        return ",".join(f"{key}={each}" for key, each in value.items())
    return "null" if value is None else str(value)
