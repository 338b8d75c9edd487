"""sweep: many trainings, in search of options."""

import argparse
import time
from pathlib import Path
from typing import Any

from rl_workbench.env_ids import as_file_name
from rl_workbench.extras import need
from rl_workbench.tools.commands.shared import number
from rl_workbench.tools.sweep.ranges import read_ranges
from rl_workbench.tools.sweep.sweep import Sweep, run_sweep
from rl_workbench.tools.sweep.trainers import trainer
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options.options import key_values
from rl_workbench.training.options.training_options import known_options
from rl_workbench.training.run.interrupt import Interrupt


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
    add("--out", type=Path, metavar="FOLDER",
        help="of the study; one that exists is gone on with (runs/sweep__ENV__ALGO__TIME)")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Searches.

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
    section = kind.section.format(env_id=env_id)
    place = f"runs/sweep__{as_file_name(env_id)}__{algorithm}__{int(time.time())}"
    folder = arguments.out or Path(place)
    sweep = Sweep(folder, section, ranges, arguments.trials, arguments.seeds, arguments.seed)
    run_sweep(sweep, trainer(algorithm, fixed), interrupt)
