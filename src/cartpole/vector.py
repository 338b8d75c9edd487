"""Many cart-poles at once: what `gymnasium.make_vec` makes by default."""

from typing import Any

from gymnasium.vector import AutoresetMode

from cartpole.registration import ENTRY_POINT
from robot_envs.vector.environment import RobotVectorEnv


class CartPoleVectorEnv(RobotVectorEnv):
    """`num_envs` environments with worlds of their own; what `gymnasium.make_vec` makes by default.

    Each gives exactly what it would give alone, whatever the number of workers: a seed s stands
    for s, s + 1, ..., one for each environment.

    | argument         | default       | meaning                                               |
    |------------------|---------------|-------------------------------------------------------|
    | `num_envs`       |               | number of environments                                |
    | `workers`        | what pays     | worker processes; 0: all worlds in this process       |
    | `autoreset_mode` | `"next_step"` | Gymnasium's: also `"same_step"` and `"disabled"`      |
    | others           |               | as for `gymnasium.make`, see `CartPoleEnv`            |

    `vectorization_mode="sync"` and `"async"` give Gymnasium's own classes instead; the latter has
    one process for each environment, which is slower.

    Raises:
        ValueError: if an option makes no sense.
        RobotEnvError: if a worker can't make its worlds.
    """

    def __init__(
        self,
        num_envs: int,
        task: str = "balance",
        *,
        workers: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        **options: Any,
    ) -> None:
        super().__init__(
            num_envs,
            ENTRY_POINT,
            workers=workers,
            autoreset_mode=autoreset_mode,
            task=task,
            **options,
        )
