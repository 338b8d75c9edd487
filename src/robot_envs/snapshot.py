"""The snapshot of an environment."""

from typing import Any, NamedTuple

import numpy as np

from robot_envs.variation import Variation
from robot_envs.world_state import InitialState, WorldState


class EnvSnapshot(NamedTuple):
    """What `RobotEnv.save_state` returns."""

    of: object  # the environment
    variation: Variation
    episode: tuple[WorldState, dict[str, Any], InitialState, int | None, np.random.Generator]
    states: list[Any]  # of generator, imperfections, task and randomisation
    world: Any  # the backend's

    def __reduce__(self) -> Any:
        raise TypeError("a snapshot can't be copied or pickled; restore_state() may take it often")
