"""The cart-pole's environments by task and plain options: what stands behind `gymnasium.make`."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from cartpole.environment import CartPoleEnv
from cartpole.tasks import TASKS, CartPoleTask
from cartpole.variation import Randomisation
from robot_envs.making import check_options
from robot_envs.vector import RobotVectorEnv

OWN = tuple(each.name for each in fields(Randomisation))


def make_environment(
    task: str,
    backend: str | None = None,
    *,
    noise: float | None = None,
    randomisation: Mapping[str, Any] | None = None,
    **options: Any,
) -> CartPoleEnv:
    """Makes an environment; the options are explained in `CartPoleEnv`.

    Raises:
        ValueError: if an option makes no sense.
        RobotEnvError: if the robot can't be brought up.
    """
    check_options(options, ("noise",))
    varied: Randomisation | Mapping[str, Any] | None = randomisation
    if randomisation and set(randomisation) <= set(OWN):
        varied = Randomisation(**randomisation)
    return CartPoleEnv(make_task(task, noise), backend, randomisation=varied, **options)


def make_vector(num_envs: int, **options: Any) -> RobotVectorEnv:
    """Makes several, as `gymnasium.make_vec` does; see `RobotVectorEnv`.

    Raises:
        ValueError: if an option makes no sense.
        RobotEnvError: if a robot can't be brought up.
    """
    return RobotVectorEnv(num_envs, make_environment, **options)


def make_task(name: str, noise: float | None = None) -> CartPoleTask:
    """Makes a task; None is the task's own noise.

    Raises:
        ValueError: if there is no such task, or the noise makes no sense.
    """
    if name not in TASKS:
        raise ValueError(f"there is no task {name!r}; there are {', '.join(TASKS)}")
    return TASKS[name]() if noise is None else TASKS[name](noise=noise)  # type: ignore[call-arg]
