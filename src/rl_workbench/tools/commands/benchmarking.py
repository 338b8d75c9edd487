"""benchmark: one training or several variants of it, over several seeds."""

import argparse
import contextlib
import datetime
import json
import os
import platform
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.benchmark import benchmark
from rl_workbench.tools.benchmark.suites import (
    SEEDS,
    Suite,
    check_package,
    make_variant,
    read_suite,
)
from rl_workbench.tools.benchmark.trainings import Job, Trainings
from rl_workbench.tools.commands.shared import number
from rl_workbench.tools.pictures.curves import learning_curves
from rl_workbench.tools.pictures.panels import evaluation_panels
from rl_workbench.tools.runs.runs import Run, open_run, threshold
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options.options import key_values
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.progress import warn
from rl_workbench.training.run.results import write_figure, write_file, write_json

RECORD = "suite.json"


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
    add("--jobs", type=number(1), default=1, metavar="N",
        help="trainings at a time, each on one core (default 1)")  # fmt: skip
    add("--episodes", type=number(1), default=100, metavar="N",
        help="unseen greedy episodes for each policy's figure (default 100)")  # fmt: skip
    add("--out", type=Path, metavar="FOLDER",
        help="for runs, tables and curves; one that was interrupted is gone on with "
        "(runs/benchmark/SUITE)")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Trains what isn't trained yet, then writes results.md, results.json and two pictures.

    Raises:
        WorkbenchError: if a name is unknown, the folder holds another benchmark or one runs in
            it, or no run could be made.
    """
    suite = _suite(arguments)
    for variant in suite.variants:
        check_package(variant)
    folder = (arguments.out or Path("runs/benchmark") / suite.name).resolve()
    seeds = range(arguments.first_seed, arguments.first_seed + (arguments.seeds or suite.seeds))
    _claim(folder, suite)
    jobs = [
        Job(variant, seed, folder / variant.name / f"seed_{seed}")
        for variant in suite.variants
        for seed in seeds
    ]
    with run_folder.held(folder):
        interrupt.defer()
        Trainings(_say, arguments.program).run(jobs, arguments.jobs, interrupt)
        if interrupt.requested():
            _say("interrupted; the same command goes on")
            return
        interrupt.at_once()  # what follows takes minutes, and can be made again
        _report(folder, suite, jobs, arguments)


def _say(text: str) -> None:
    print(text, flush=True)


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
    name = f"{algorithm}__{given['env_id'].replace('/', '-').replace(':', '-')}"
    return Suite(name, "", SEEDS, (make_variant("--params", name, options),))


def _claim(folder: Path, suite: Suite) -> None:
    """Notes what the folder's runs are, or checks that they are the same."""
    path, wanted = folder / RECORD, [asdict(variant) for variant in suite.variants]
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        if folder.is_dir() and any(folder.iterdir()):
            raise WorkbenchError(f"{folder} holds something else; name another folder") from None
        write_json(path, wanted)
        return
    except (OSError, ValueError) as error:
        raise WorkbenchError(f"can't read {path}: {error}") from error
    if found != json.loads(json.dumps(wanted)):
        raise WorkbenchError(f"{folder} holds runs with other options; name another folder")


def _report(folder: Path, suite: Suite, jobs: list[Job], arguments: argparse.Namespace) -> None:
    runs = _readable(jobs)
    rows = [benchmark.examine(job, arguments.episodes, warn) for job in jobs]
    if all(row.steps is None for row in rows):
        raise WorkbenchError(f"no training came to anything; see {jobs[0].log}")
    lines = {run.experiment: threshold(run.env_id) for run in runs}
    tables = [benchmark.summary_table(rows, lines), benchmark.table(rows)]
    head = f"# {suite.name}\n\n{suite.about}\n\n{_machine(arguments, set(lines.values()))}"
    text = "\n\n".join([head, *tables]) + "\n"
    write_file(folder / "results.md", lambda stream: stream.write(text.encode()))
    write_json(folder / "results.json", _content(rows, arguments))
    for name, draw in (("curves", learning_curves), ("evaluations", evaluation_panels)):
        _draw(folder / f"{name}.png", draw, runs)
    _say("\n\n".join(reversed(tables)))
    _say(f"\ntables, figures and curves lie in {folder}")


def _draw(path: Path, draw: Callable[[list[Run]], Figure], runs: list[Run]) -> None:
    """A picture that can't be drawn costs no table."""
    try:
        figure = draw(runs)
    except WorkbenchError as error:
        warn(f"no {path.name}: {error}")
        return
    write_figure(path, figure)


def _readable(jobs: list[Job]) -> list[Run]:
    """The runs whose record can be read; the row of each other one says why not."""
    found = []
    for job in jobs:
        with contextlib.suppress(WorkbenchError):
            found.append(open_run(job.folder))
    return found


def _machine(arguments: argparse.Namespace, lines: set[float | None]) -> str:
    about = f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
    solved = "".join(f" Solved: {line:g}." for line in lines if line is not None)
    return (
        f"{datetime.date.today().isoformat()}, {about}, {arguments.jobs} at a time. Best and final: "
        f"mean return of {arguments.episodes} greedy episodes that nothing was chosen by.{solved}"
    )


def _content(rows: list[benchmark.Row], arguments: argparse.Namespace) -> dict[str, Any]:
    return {
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "versions": run_folder.versions(),
        "episodes": arguments.episodes,
        "jobs": arguments.jobs,
        "runs": benchmark.content(rows),
    }
