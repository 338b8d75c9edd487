"""benchmark: one training or several variants of it, over several seeds."""

import argparse
import datetime
import json
import os
import platform
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple

from files.content import open_text
from rl_workbench.env_ids import as_file_name, threshold
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import key_values
from rl_workbench.plotting.curves import evaluation_curves, seed_curves
from rl_workbench.starting import Interrupt
from rl_workbench.storage import as_json, as_text, write_file
from rl_workbench.tools.benchmark import tables
from rl_workbench.tools.benchmark.results import RunResult, examine
from rl_workbench.tools.benchmark.suites import (
    SEEDS,
    Suite,
    Variant,
    check_package,
    make_variant,
    read_suite,
    training_flags,
)
from rl_workbench.tools.commands.machines import add_job_flags, machines_for
from rl_workbench.tools.commands.shared import number, write_figure
from rl_workbench.tools.jobs.job import Job, last_words
from rl_workbench.tools.jobs.running import run_jobs
from rl_workbench.tools.pictures.panels import seed_panels, variant_panels
from rl_workbench.tools.runs.runs import Run, open_run
from rl_workbench.training import folder as run_folder
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.progress import tell, warn

RECORD = "suite.json"


class _Planned(NamedTuple):
    """A training of the benchmark."""

    variant: str
    seed: int
    job: Job


class _Hint(argparse.Action):
    """A flag of `train` and `sweep`, which somebody may expect here."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        parser.error(f"{self.option_strings[0]} is an option of the training: {self.metavar}")


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Its flags."""
    add = parser.add_argument
    add("suite", nargs="?", metavar="SUITE",
        help="a section of config/benchmark.yaml; without one, the training that --algo, --env-id "
        "and --params name")  # fmt: skip
    add("--suites", type=Path, metavar="FILE", help="other suites than config/benchmark.yaml's")
    add("--algo", choices=ALGORITHMS, help="default dqn")
    add("--env-id", metavar="ID", help="default CartPole-v1")
    add("--params", nargs="+", default=[], metavar="KEY=VALUE", help="options of the training")
    add("--seeds", type=number(1), metavar="N", help=f"how many (the suite's, or {SEEDS})")
    add("--first-seed", type=number(0), default=0, metavar="N", help="default 0")
    add_job_flags(parser)
    add("--episodes", type=number(1), default=100, metavar="N",
        help="unseen greedy episodes for each policy's figure (default 100)")  # fmt: skip
    add("--out", type=Path, metavar="FOLDER",
        help="for runs, tables and curves; one that was interrupted is gone on with "
        "(runs/benchmark/SUITE)")  # fmt: skip
    add("--total-timesteps", nargs="?", action=_Hint, help=argparse.SUPPRESS,
        metavar="--params total_timesteps=N, or the suite's own")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Trains what isn't trained yet, then writes results.md, costs.md, results.json and two pictures.

    Raises:
        WorkbenchError: if a name is unknown, the folder holds another benchmark or one runs in
            it, or no run could be made.
    """
    suite = _suite(arguments)
    for variant in suite.variants:
        check_package(variant)
    folder = (arguments.out or Path("runs/benchmark") / suite.name).resolve()
    seeds = range(arguments.first_seed, arguments.first_seed + (arguments.seeds or suite.seeds))
    _make(folder)
    with run_folder.held(folder, "another benchmark"):
        _claim(folder, suite)
        planned = [
            _Planned(variant.name, seed, _job(variant, seed, folder))
            for variant in suite.variants
            for seed in seeds
        ]
        jobs = [each.job for each in planned]
        with machines_for(arguments, folder, interrupt) as machines:
            interrupt.defer()
            run_jobs(machines, folder, jobs, interrupt, known=jobs)
            where = machines.about()
        if interrupt.requested():
            tell("interrupted; the same command goes on")
            return
        interrupt.at_once()  # what follows takes minutes, and can be made again
        _report(folder, suite, planned, arguments, where)


def _job(variant: Variant, seed: int, folder: Path) -> Job:
    place = folder / variant.name / f"seed_{seed}"
    return Job(f"{variant.name}, seed {seed}", place, tuple(training_flags(variant, seed)))


def _suite(arguments: argparse.Namespace) -> Suite:
    if arguments.suite:
        if arguments.algo or arguments.env_id or arguments.params:
            raise WorkbenchError(
                "a suite says itself what is trained: no --algo, no --env-id, no --params"
            )
        return read_suite(arguments.suite, arguments.suites)
    if arguments.suites:
        raise WorkbenchError(f"which suite of {arguments.suites}? Name one")
    algorithm = arguments.algo or "dqn"
    given = {
        "env_id": arguments.env_id or "CartPole-v1",
        **key_values(arguments.params, "--params"),
    }
    options = {"algo": algorithm, **given}
    name = f"{algorithm}__{as_file_name(given['env_id'])}"
    return Suite(name, "", SEEDS, (make_variant("--params", name, options),))


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WorkbenchError(f"can't make {folder}: {error.strerror}") from error


def _claim(folder: Path, suite: Suite) -> None:
    """Notes what the folder's runs are, or checks that they are the same."""
    path, wanted = folder / RECORD, [asdict(variant) for variant in suite.variants]
    try:
        with open_text(path) as file:
            found = json.load(file)
    except FileNotFoundError:
        if folder.is_dir() and any(folder.iterdir()):
            raise WorkbenchError(f"{folder} holds something else; name another folder") from None
        write_file(path, as_json(wanted))
        return
    except (OSError, ValueError) as error:
        raise WorkbenchError(f"can't read {path}: {error}") from error
    if found != json.loads(json.dumps(wanted)):
        raise WorkbenchError(f"{folder} holds runs with other options; name another folder")


def _report(
    folder: Path, suite: Suite, planned: list[_Planned], arguments: argparse.Namespace, where: str
) -> None:
    runs, results = _examine(planned, arguments.episodes)
    # The same table wherever the folder lies.
    results = [replace(each, fault=each.fault.replace(f"{folder}/", "")) for each in results]
    if all(each.steps is None for each in results):
        raise WorkbenchError(f"no training came to anything; see {planned[0].job.log}")
    thresholds = {run.experiment: threshold(run.env_id) for run in runs}
    groups = tables.grouped(results)
    summary = tables.summary_table(groups, tables.RESULTS_SUMMARY, thresholds)
    every = tables.table(results, tables.RESULTS)
    about = _measured(arguments.episodes, thresholds.values())
    text = f"# {suite.name}\n\n{suite.about}\n\n{about}\n\n{summary}\n\n{every}\n"
    write_file(folder / "results.md", as_text(text))
    costs = tables.summary_table(groups, tables.COSTS_SUMMARY)
    costs += f"\n\n{tables.table(results, tables.COSTS)}"
    text = f"# {suite.name}: what it took\n\n{_machine(where)}\n\n{costs}\n"
    write_file(folder / "costs.md", as_text(text))
    write_file(folder / "results.json", as_json(_content(results, arguments, where)))
    for name, panels, draw in (
        ("curves.png", seed_panels, seed_curves),
        ("evaluations.png", variant_panels, evaluation_curves),
    ):
        try:  # a picture that can't be drawn costs no table
            figure = draw(panels(runs))
        except WorkbenchError as error:
            warn(f"no {name}: {error}")
        else:
            write_figure(folder / name, figure)
    tell(f"{every}\n\n{summary}\n\n{costs}\n\ntables, figures and curves lie in {folder}")


def _examine(planned: list[_Planned], episodes: int) -> tuple[list[Run], list[RunResult]]:
    """The runs whose record can be read, and a row of figures for every one that was planned."""
    runs, results = [], []
    for name, seed, job in planned:
        try:
            runs.append(open_run(job.folder))
        except WorkbenchError as error:
            fault = last_words(job.log) or str(error)  # a training that couldn't begin has said why
            results.append(RunResult(name, seed, job.folder.name, fault=fault))
        else:
            results.append(examine(runs[-1], name, episodes, warn, also_last=True))
    return runs, results


def _measured(episodes: int, thresholds: Iterable[float | None]) -> str:
    """How, without anything that depends on when or where."""
    lines = sorted({line for line in thresholds if line is not None})
    solved = "".join(f" Solved: {line:g}." for line in lines)
    return f"Best and final: mean return of {episodes} greedy episodes that nothing was chosen by.{solved}"


def _machine(where: str) -> str:
    about = f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
    return f"{datetime.date.today().isoformat()}, {about}, {where}."


def _content(results: list[RunResult], arguments: argparse.Namespace, where: str) -> dict[str, Any]:
    return {
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "versions": run_folder.versions(),
        "episodes": arguments.episodes,
        "where": where,
        "runs": tables.rows(results, {**tables.RESULTS, **tables.COSTS}),
    }
