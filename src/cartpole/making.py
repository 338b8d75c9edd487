"""The cart-pole's environments by task and plain options: what stands behind `gymnasium.make`."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cartpole.environment import CartPoleEnv
from cartpole.robot import CONTROL_PERIOD, ROBOT
from cartpole.tasks import TASKS, CartPoleTask
from cartpole.variation import Randomisation
from robot_envs.backends.backend import DEFAULT_ENGINE
from robot_envs.backends.choice import IN_PROCESS, make_backend
from robot_envs.picture import HEIGHT, WIDTH
from robot_envs.sensing import Sensor


def make_environment(
    task: str,
    backend: str = IN_PROCESS,
    *,
    engine: str = DEFAULT_ENGINE,
    control_period: float | None = CONTROL_PERIOD,
    noise: float | None = None,
    max_steps: int | None = None,
    sensor_noise: float | Sequence[float] | np.ndarray = 0.0,
    sensor_delay: int = 0,
    randomisation: Mapping[str, float] | None = None,
    render_mode: str | None = None,
    width: int = WIDTH,
    height: int = HEIGHT,
) -> CartPoleEnv:
    """Makes an environment; the options are explained in `CartPoleEnv`.

    Raises:
        ValueError: if an option makes no sense.
        RobotEnvError: if the robot can't be brought up.
    """
    made = make_task(task, noise, max_steps)
    sensor = Sensor(ROBOT, sensor_noise, sensor_delay)
    drawn = Randomisation(**randomisation) if randomisation else None
    robot = make_backend(ROBOT, backend, control_period, made.height, engine)
    try:
        return CartPoleEnv(
            robot,
            made,
            sensor=None if sensor.is_exact else sensor,
            randomisation=drawn,
            render_mode=render_mode,
            width=width,
            height=height,
            control_period=CONTROL_PERIOD if control_period is None else control_period,
        )
    except BaseException:
        robot.close()
        raise


def make_task(name: str, noise: float | None = None, max_steps: int | None = None) -> CartPoleTask:
    """Makes a task; what is None is the task's own default.

    Raises:
        ValueError: if there is no such task, or an option makes no sense.
    """
    if name not in TASKS:
        raise ValueError(f"there is no task {name!r}; there are {', '.join(TASKS)}")
    given = {"noise": noise, "max_steps": max_steps}
    chosen: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    return TASKS[name](**chosen)
