"""The algorithms that can be trained, by the names that --algo knows."""

from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.dqn.kind import DQN
from rl_workbench.training.options.kind import AlgorithmKind
from rl_workbench.training.options.options import unknown
from rl_workbench.training.options.record import CONFIG_RECORD, read_record
from rl_workbench.training.options.training_options import TrainingOptions, options_of
from rl_workbench.training.pg.kind import REINFORCE, REINFORCE_DOCUMENT
from rl_workbench.training.sb3.kind import SB3

ALGORITHMS = {kind.name: kind for kind in (DQN, REINFORCE, REINFORCE_DOCUMENT, *SB3)}
RENAMED = {"pg": REINFORCE.name, "gae": REINFORCE.name, "document": REINFORCE_DOCUMENT.name}


def algorithm(name: str) -> AlgorithmKind:
    """The algorithm of that name.

    Raises:
        WorkbenchError: if there is none; names the nearest.
    """
    if name in ALGORITHMS:
        return ALGORITHMS[name]
    if name in RENAMED:
        raise WorkbenchError(f"the algorithm {name} is called {RENAMED[name]} now")
    raise WorkbenchError(unknown("algorithm", name, list(ALGORITHMS)))


def recorded_options(content: Any, origin: str) -> TrainingOptions:
    """The options of a training, from its record.

    Args:
        content: what config.json or a checkpoint's `config` holds.
        origin: the file, for the errors.

    Raises:
        WorkbenchError: if it holds something else, or another version's.
    """
    name = content.get("algorithm") if isinstance(content, dict) else None
    if not isinstance(name, str) or "hyperparameters" not in content:
        raise WorkbenchError(f"{origin} isn't the configuration of a training of this version")
    return options_of(algorithm(name), content, origin)


def recorded_kind(folder: Path) -> AlgorithmKind:
    """The algorithm of the training in a run folder.

    Raises:
        WorkbenchError: if there is none.
    """
    return recorded_options(read_record(folder), str(folder / CONFIG_RECORD)).kind
