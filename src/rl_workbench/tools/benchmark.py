"""`benchmark`: one training, or several variants of it, over several seeds."""

import argparse
import datetime
import os
import platform
import re
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rl_workbench.env_ids import as_file_name, threshold
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import is_plain, key_values
from rl_workbench.starting import Interrupt
from rl_workbench.storage import as_json, as_text, write_file
from rl_workbench.tools.flags import add_job_flags, number, write_figure
from rl_workbench.tools.jobs import Job, last_words
from rl_workbench.tools.pool import claimed, job_pool
from rl_workbench.tools.runs import SUITE_RECORD, Run, open_run
from rl_workbench.training import folder as run_folder
from rl_workbench.training.algorithms import ALGORITHMS, algorithm
from rl_workbench.training.options import default_file, read_section
from rl_workbench.training.progress import tell, warn
from rl_workbench.training.train import choose

if TYPE_CHECKING:
    from rl_workbench.tools.results import RunResult

CONFIG = "benchmark.yaml"
NAME = re.compile(r"\w[\w.+-]*")  # of a variant, and so of a folder
OWN = ("seed", "run_dir", "exp_name")  # options that the benchmark itself sets
SEEDS = 5  # default
KEYS = ("about", "seeds", "common", "variants")


@dataclass(frozen=True)
class Variant:
    """One configuration of a training; each of its seeds is a run."""

    name: str
    algorithm: str
    options: dict[str, Any]


@dataclass(frozen=True)
class Suite:
    """The variants that a benchmark trains and compares."""

    name: str
    about: str
    seeds: int  # default number per variant
    variants: tuple[Variant, ...]


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add = parser.add_argument
    add("suite", nargs="?", metavar="SUITE",
        help="a section of config/benchmark.yaml; without one, the training that --algo, --env-id "
        "and --params name")  # fmt: skip
    add("--suites", type=Path, metavar="FILE", help="suites, instead of config/benchmark.yaml")
    add("--algo", choices=ALGORITHMS, help="default dqn")
    add("--env-id", metavar="ID", help="default CartPole-v1")
    add("--config", metavar="FILE", help="options of the training in YAML, as train takes them")
    add("--params", nargs="+", default=[], metavar="KEY=VALUE", help="options of the training")
    add("--total-timesteps", type=number(1), metavar="N", help="length of each training [steps]")
    add("--seeds", type=number(1), metavar="N", help=f"how many (the suite's, or {SEEDS})")
    add_job_flags(parser)
    add("--episodes", type=number(1), default=100, metavar="N",
        help="greedy episodes on fresh seeds for each policy's score (default 100)")  # fmt: skip
    add("--out", type=Path, metavar="FOLDER",
        help="folder for runs, tables and curves; an interrupted benchmark is continued there "
        "(runs/benchmark/SUITE)")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Trains the incomplete runs, then writes results.md, costs.md, results.json and two pictures."""
    suite = _suite(arguments)
    folder = (arguments.out or Path("runs/benchmark") / suite.name).resolve()
    jobs = [Job(folder, variant.name, seed, training_flags(variant))
            for variant in suite.variants for seed in range(arguments.seeds or suite.seeds)]  # fmt: skip
    record = [asdict(each) for each in suite.variants]
    with claimed(folder / SUITE_RECORD, record, "benchmark"):
        with job_pool(arguments, folder, interrupt, len(jobs)) as pool:
            interrupt.defer()
            pool.map(pool.run, jobs)
        if interrupt.requested():
            tell("interrupted; run the same command again to continue")
            return
        interrupt.at_once()  # the report takes minutes and can be repeated
        _report(folder, suite, jobs, arguments.episodes, pool.where)


def _suite(arguments: argparse.Namespace) -> Suite:
    steps = arguments.total_timesteps
    if arguments.suite:
        if arguments.algo or arguments.env_id or arguments.config or arguments.params or steps:
            raise WorkbenchError(
                "a suite defines its trainings and takes no --algo, --env-id, --config, --total-timesteps "
                "or --params"
            )
        return read_suite(arguments.suite, arguments.suites)
    if arguments.suites:
        raise WorkbenchError(f"which suite of {arguments.suites}? Name one")
    kind, env_id = arguments.algo or "dqn", arguments.env_id or "CartPole-v1"
    given = {"algo": kind, "env_id": env_id, **key_values(arguments.params, "--params")}
    own = {"config": arguments.config, "total_timesteps": steps}
    given |= {key: str(value) for key, value in own.items() if value}
    name = f"{kind}__{as_file_name(given['env_id'])}"
    return Suite(name, "", SEEDS, (make_variant("--params", name, given),))


def read_suite(name: str, path: Path | None = None) -> Suite:
    """Reads a suite from a file, by default config/benchmark.yaml."""
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
    if type(seeds) is not int or seeds < 1:
        raise WorkbenchError(f"{origin}: seeds is a number from 1, not {seeds!r}")
    return Suite(name, str(section.get("about", "")), seeds, variants)


def _options(value: Any, origin: str) -> dict[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, dict) or not is_plain(value):
        raise WorkbenchError(f"{origin} has options with plain values, not {value!r}")
    return value


def make_variant(origin: str, name: str, options: dict[str, Any]) -> Variant:
    """Makes a variant, whose algorithm must be installed and know its options."""
    if not NAME.fullmatch(name):
        raise WorkbenchError(f"{origin}: a variant's name is letters, digits, _, -, + and ., not {name!r}")
    rest = {key: value for key, value in options.items() if value is not None}
    kind = str(rest.pop("algo", "dqn"))
    if kind not in ALGORITHMS:
        raise WorkbenchError(f"{origin}: algo is one of {', '.join(ALGORITHMS)}, not {kind!r}")
    taken = [key for key in rest if key in OWN]
    if taken:
        raise WorkbenchError(f"{origin}: the benchmark sets {taken[0]} itself")
    variant = Variant(name, kind, rest)
    try:
        choose(algorithm(kind), training_flags(variant)[2:])
    except WorkbenchError as error:
        raise WorkbenchError(f"{name}: {error}") from error
    return variant


def training_flags(variant: Variant) -> list[str]:
    """Returns the flags of `train` that all runs of a variant share."""
    rest = dict(variant.options)
    if "config" in rest:  # a cluster node may have another current folder
        rest["config"] = Path(rest["config"]).resolve()
    flags = [f"--{key}={rest.pop(key)}" for key in ("config", "preset") if key in rest]
    pairs = [f"{key}={_text(value)}" for key, value in rest.items()]
    return ["--algo", variant.algorithm, *flags, *(["--params", *pairs] if pairs else [])]


def _text(value: Any) -> str:
    """Formats a value so that `train` reads the same value back."""
    is_mapping = isinstance(value, dict)
    return ",".join(f"{key}={each}" for key, each in value.items()) if is_mapping else str(value)


def _report(folder: Path, suite: Suite, jobs: list[Job], episodes: int, where: str) -> None:
    """Writes all files. results.md depends neither on interruptions nor on the folder's place."""
    from rl_workbench.tools import results as figures

    runs, results = _examine(jobs, episodes)
    results = [replace(each, fault=each.fault.replace(f"{folder}/", "")) for each in results]
    summary = figures.summary_table(figures.grouped(results), figures.SUMMARY)
    every = figures.table(results, figures.RESULTS)
    costs = figures.table(results, figures.COSTS)
    content = {
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "versions": run_folder.versions(),
        "episodes": episodes,
        "where": where,
        "runs": figures.rows(results, {**figures.RESULTS, **figures.COSTS}),
    }
    machine = f"{datetime.date.today().isoformat()}, {platform.machine()}, {os.cpu_count()} cores"
    machine += f", load {os.getloadavg()[0]:.1f}"
    lines = {line for run in runs if (line := threshold(run.env_id)) is not None}
    text = " Solved: the first confirmed evaluation of at least {:g}."
    solved = "".join(map(text.format, sorted(lines)))
    about = f"{suite.about}\n\nBest and final: mean return of {episodes} greedy episodes on fresh "
    about += f"seeds, which chose no policy.{solved}"
    for name, write in (
        ("results.md", as_text(f"# {suite.name}\n\n{about}\n\n{summary}\n\n{every}\n")),
        ("costs.md", as_text(f"# {suite.name}: costs\n\n{machine}, {where}.\n\n{costs}\n")),
        ("results.json", as_json(content)),
    ):
        write_file(folder / name, write)
    _draw(folder, runs)
    tell(f"{every}\n\n{summary}\n\n{costs}\n\ntables, figures and curves are in {folder}")
    failed = [each for each in results if each.fault]
    if failed:
        raise WorkbenchError(
            f"{len(failed)} of {len(results)} trainings failed; the first one: {failed[0].fault}"
        )


def _draw(folder: Path, runs: list[Run]) -> None:
    """Draws the pictures, the others too if one can't be drawn."""
    from rl_workbench.plotting import evaluation_curves, seed_curves
    from rl_workbench.tools.plot import seed_panels, variant_panels

    for name, panels, draw in (
        ("curves.png", seed_panels, seed_curves),
        ("evaluations.png", variant_panels, evaluation_curves),
    ):
        try:
            write_figure(folder / name, draw(panels(runs)))
        except WorkbenchError as error:
            warn(f"no {name}: {error}")


def _examine(jobs: list[Job], episodes: int) -> "tuple[list[Run], list[RunResult]]":
    """Returns the runs whose record is readable, and a row of results for every planned run."""
    from rl_workbench.tools.results import RunResult, examine

    runs, results = [], []
    for count, job in enumerate(jobs, 1):
        try:
            runs.append(open_run(job.folder))
        except WorkbenchError as error:
            fault = last_words(job.log) or str(error)  # the log says why a training couldn't begin
            results.append(RunResult(job.group, job.seed, job.folder.name, fault=fault))
        else:
            each = f"{episodes} episodes each by the best and the last policy"
            tell(f"evaluating {count} of {len(jobs)}: {each} of {job.name}")
            results.append(examine(runs[-1], job.group, episodes, warn, also_last=True))
    return runs, results
