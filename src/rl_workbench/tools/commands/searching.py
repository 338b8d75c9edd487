"""sweep: many trainings, in search of options."""

import argparse
import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from files.content import open_text
from rl_workbench.env_ids import as_file_name
from rl_workbench.errors import WorkbenchError, need
from rl_workbench.option import key_values
from rl_workbench.starting import Interrupt
from rl_workbench.storage import as_json, check_writable, write_file
from rl_workbench.tools.commands.machines import add_job_flags, machines_for
from rl_workbench.tools.commands.shared import number
from rl_workbench.tools.jobs.running import run_jobs
from rl_workbench.tools.sweep.ranges import read_ranges
from rl_workbench.tools.sweep.study import PRUNERS, Pruner, Study
from rl_workbench.tools.sweep.sweep import Search, Sweep, write_results
from rl_workbench.tools.sweep.trainings import flags
from rl_workbench.training import folder as run_folder
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.command_line import choose
from rl_workbench.training.options import RunOptions, known_options
from rl_workbench.training.progress import tell

RECORD, OLD = "sweep.json", "study.db"


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Its flags."""
    add = parser.add_argument
    add("--algo", choices=tuple(ALGORITHMS), default="dqn", help="default dqn")
    add("--env-id", default="CartPole-v1", metavar="ID", help="default CartPole-v1")
    add(
        "--params",
        nargs="+",
        default=[],
        metavar="KEY=VALUE",
        help="options of every training, which aren't searched then",
    )
    add("--ranges", type=Path, metavar="FILE", help="what is searched (config/sweep.yaml)")
    add("--trials", type=number(1), default=20, metavar="N", help="in all (default 20)")
    add("--seeds", type=number(1), default=1, metavar="N", help="trainings a trial (default 1)")
    add("--seed", type=number(0), default=0, metavar="N", help="of the search (default 0)")
    add("--total-timesteps", type=number(1), metavar="N", help="of each training")
    add("--pruner", choices=PRUNERS, default=PRUNERS[0],
        help="ends trials whose evaluations fall behind the others' (default median)")  # fmt: skip
    add_job_flags(parser)
    add("--out", type=Path, metavar="FOLDER",
        help="of the study; one that exists is gone on with (runs/sweep__ENV__ALGO)")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Searches until there are as many trials as wanted, or until interrupted.

    Raises:
        WorkbenchError: if something fails that the user can mend.
    """
    need("optuna", "Optuna", "sweep")
    algorithm, env_id = arguments.algo, arguments.env_id
    kind = ALGORITHMS[algorithm]
    known = known_options(kind)
    fixed: dict[str, Any] = {**key_values(arguments.params, "--params"), "env_id": env_id}
    if arguments.total_timesteps:
        fixed["total_timesteps"] = arguments.total_timesteps
    known.read(fixed, "--params")  # a mistake would be every trial's
    ranges = read_ranges(arguments.ranges, algorithm, env_id, known.names)
    ranges = {name: each for name, each in ranges.items() if name not in fixed}
    place = f"runs/sweep__{as_file_name(env_id)}__{algorithm}"
    sweep = Sweep(
        (arguments.out or Path(place)).resolve(), algorithm, fixed, ranges,
        arguments.trials, arguments.seeds, kind.section.format(env_id=env_id),
    )  # fmt: skip
    usual = _run_options(sweep, {})
    pruner = Pruner(arguments.pruner, usual.eval_frequency, usual.total_timesteps)
    check_writable(sweep.folder / RECORD)
    at_once = arguments.jobs or (1 if arguments.ray is None else None)
    with run_folder.held(sweep.folder, "another search"), _told_of_the_disk(sweep.folder):
        _claim(sweep, arguments.seed)
        study = Study(sweep.folder, ranges, arguments.seed, pruner)
        search = Search(
            sweep, study, lambda values: _run_options(sweep, values).eval_frequency, at_once == 1
        )
        tell(f"{study.ended()} of {sweep.trials} trials are done: {sweep.folder}")
        with machines_for(arguments, sweep.folder, interrupt) as machines:
            interrupt.defer()
            run_jobs(machines, sweep.folder, search.jobs(), interrupt, watches=[search])
        write_results(sweep, study)
        if interrupt.requested():
            tell("interrupted; the same command goes on")


@contextlib.contextmanager
def _told_of_the_disk(folder: Path) -> Iterator[None]:
    """Optuna writes in its folder, too.

    Raises:
        WorkbenchError: if the disk refuses.
    """
    try:
        yield
    except OSError as error:
        raise WorkbenchError(f"can't write to {folder}: {error.strerror}") from error


def _run_options(sweep: Sweep, values: dict[str, Any]) -> RunOptions:
    """Those of a training with the values that a trial has picked."""
    _, _, *rest = flags(sweep.algorithm, {**sweep.options, **values})
    return choose(ALGORITHMS[sweep.algorithm], rest).run


def _claim(sweep: Sweep, seed: int) -> None:
    """Notes what a folder's search is, or checks that it is the same.

    Raises:
        WorkbenchError: if it has another one, or one that can't go on.
    """
    wanted = {
        "algorithm": sweep.algorithm,
        "options": sweep.options,
        "ranges": {name: each._asdict() for name, each in sweep.ranges.items()},
        "seeds": sweep.seeds,
        "seed": seed,
    }
    path = sweep.folder / RECORD
    try:
        with open_text(path) as file:
            found = json.load(file)
    except FileNotFoundError:
        if (sweep.folder / OLD).exists():
            raise WorkbenchError(
                f"{sweep.folder / OLD} is a search of an earlier version, which can't go on; "
                "begin a new one with another --out"
            ) from None
        write_file(path, as_json(wanted))
        return
    except (OSError, ValueError) as error:
        raise WorkbenchError(f"can't read {path}: {error}") from error
    if found != json.loads(json.dumps(wanted)):
        raise WorkbenchError(
            f"{sweep.folder} holds a search of other options, ranges or seeds; name another folder by --out"
        )
