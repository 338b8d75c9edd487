"""Environments by name and plain options: what stands behind `gymnasium.make`."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cartpole.envs.cartpole_env import CartPoleEnv
from cartpole.envs.plant import CONTROL_PERIOD, DEFAULT_ENGINE, Plant
from cartpole.envs.sensor import Sensor
from cartpole.envs.variation import Randomisation
from cartpole.task import TASKS, Task

BACKENDS = ("bullet", "ros", "ros-realtime")


def make_environment(
    task: str,
    backend: str = "bullet",
    *,
    engine: str = DEFAULT_ENGINE,
    control_period: float = CONTROL_PERIOD,
    noise: float | None = None,
    max_steps: int | None = None,
    sensor_noise: float | Sequence[float] | np.ndarray = 0.0,
    sensor_delay: int = 0,
    randomisation: Mapping[str, float] | None = None,
    render_mode: str | None = None,
) -> CartPoleEnv:
    """Makes an environment; the options are explained in `CartPoleEnv`.

    Raises:
        ValueError: if an option makes no sense.
        CartpoleError: if the robot can't be brought up.
    """
    made = make_task(task, noise, max_steps)
    sensor = Sensor(sensor_noise, sensor_delay)
    drawn = Randomisation(**randomisation) if randomisation else None
    plant = make_plant(backend, made, control_period, engine)
    try:
        return CartPoleEnv(
            plant,
            made,
            sensor=sensor if sensor_delay or sensor.is_noisy else None,
            randomisation=drawn,
            render_mode=render_mode,
            control_period=control_period,
        )
    except Exception:
        plant.close()
        raise


def make_task(name: str, noise: float | None = None, max_steps: int | None = None) -> Task:
    """Makes a task; what is None is the task's own default.

    Raises:
        ValueError: if there is no such task, or an option makes no sense.
    """
    if name not in TASKS:
        raise ValueError(f"there is no task {name!r}; there are {', '.join(TASKS)}")
    given = {"noise": noise, "max_steps": max_steps}
    chosen: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    return TASKS[name](**chosen)


def make_plant(
    backend: str,
    task: Task,
    control_period: float = CONTROL_PERIOD,
    engine: str = DEFAULT_ENGINE,
) -> Plant:
    """Makes the robot that an environment of `task` moves.

    Raises:
        ValueError: if there is no such backend or engine, or the control period is no whole number
            of physics steps.
        CartpoleError: if the robot can't be brought up.
    """
    if backend == "bullet":
        from cartpole.envs.bullet_plant import BulletPlant

        return BulletPlant(control_period, task.stand_height, engine)
    if backend in BACKENDS:
        if engine != DEFAULT_ENGINE:
            raise ValueError(
                f"engine {engine!r} is for the backend 'bullet'; over ROS the simulator has its own: "
                "start it with physics:=mujoco"
            )
        from cartpole.envs.ros_backend import ros_plant

        return ros_plant(backend == "ros-realtime", control_period, task.stand_height)
    raise ValueError(f"there is no backend {backend!r}; there are {', '.join(BACKENDS)}")
