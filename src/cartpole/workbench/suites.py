"""What `benchmark` trains: variants of a training, from config/benchmark.yaml or from flags."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cartpole.errors import CartpoleError
from cartpole.training import dqn_settings
from cartpole.training.config_file import default_file, read_section
from cartpole.workbench.algorithms import ALGORITHMS, DQN

CONFIG = "benchmark.yaml"
SPECIAL = ("preset", "config")  # which section of the algorithm's file, or which other file
OWN = ("seed", "run_dir", "exp_name")  # the benchmark gives these
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
        CartpoleError: if the file has no such suite, or an option in it doesn't exist.
    """
    path = path or default_file(CONFIG)
    section = read_section(path, None, name)
    unknown = [key for key in section if key not in KEYS]
    if unknown or not isinstance(section.get("variants"), dict) or not section["variants"]:
        raise CartpoleError(f"{path}: a suite has variants, and perhaps {', '.join(KEYS[:-1])}")
    common = section.get("common") or {}
    variants = tuple(
        make_variant(f"{path}, {name}", key, {**common, **(own or {})})
        for key, own in section["variants"].items()
    )
    return Suite(name, str(section.get("about", "")), int(section.get("seeds", 5)), variants)


def make_variant(origin: str, name: str, options: dict[str, Any]) -> Variant:
    """A variant, its options checked for their names.

    Raises:
        CartpoleError: if there is no such algorithm or option; `origin` says where it stands.
    """
    rest = dict(options)
    algorithm = str(rest.pop("algo", DQN))
    if algorithm not in ALGORITHMS:
        raise CartpoleError(f"{origin}: algo is one of {', '.join(ALGORITHMS)}, not {algorithm!r}")
    taken = [key for key in rest if key in OWN]
    if taken:
        raise CartpoleError(f"{origin}: {taken[0]} is given by the benchmark")
    if algorithm == DQN:
        dqn_settings.OPTIONS.read(
            {key: value for key, value in rest.items() if key not in SPECIAL}, origin
        )
    return Variant(name, algorithm, rest)


def arguments(variant: Variant, seed: int, folder: Path) -> list[str]:
    """What `workbench.py train` is told for one run."""
    special = {key: value for key, value in variant.options.items() if key in SPECIAL}
    own = {"run_dir": folder, "exp_name": variant.name, "seed": seed, **special}
    flags = [f"--{key.replace('_', '-')}={value}" for key, value in own.items()]
    rest = [
        f"{key}={_text(value)}" for key, value in variant.options.items() if key not in SPECIAL
    ]
    return ["--algo", variant.algorithm, *flags, *(["--params", *rest] if rest else [])]


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ",".join(map(str, value))
    if isinstance(value, dict):
        return ",".join(f"{key}={each}" for key, each in value.items())
    return str(value)
