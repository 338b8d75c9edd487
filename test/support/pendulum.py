"""A robot that is no cart-pole, as a user would bring one: its description, a task, an environment."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from robot_envs.backends.choice import make_backend
from robot_envs.environment import RobotEnv
from robot_envs.robot import OverRos, Robot
from robot_envs.sensing import Sensor
from robot_envs.task import Command, Task
from robot_envs.variation import LinkScale, Variation

FILES = Path(__file__).resolve().parents[1] / "data" / "robots"
STRONGEST = 0.5  # [N m]


class PendulumState(NamedTuple):
    """One joint; 0 is upright."""

    angle: float  # [rad]
    rate: float  # [rad/s]


PENDULUM = Robot(
    model="pendulum",
    state=PendulumState,
    joints=("hinge",),
    controllers=("hinge_effort_controller",),
    commanded=("hinge_effort_controller",),
    urdf_file=lambda: FILES / "pendulum.urdf",
    parameters_file=lambda: FILES / "pendulum.yaml",
    ros=OverRos(),
)


class Upright(Task[PendulumState]):
    """The action is the motor's torque; the nearer to upright, the better."""

    start = PendulumState(0.0, 0.0)

    def __init__(self, noise: float = 0.05, max_steps: int = 200) -> None:
        super().__init__(noise, max_steps)

    def action_space(self) -> gymnasium.spaces.Box:
        return gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def observation_space(self) -> gymnasium.spaces.Box:
        high = np.array([1.0, 1.0, np.finfo(np.float32).max], np.float32)
        return gymnasium.spaces.Box(-high, high)

    def initial_command(self, state: PendulumState) -> Command:
        return (0.0,)

    def next_command(self, command: Command, action: np.ndarray) -> Command:
        return (STRONGEST * float(action[0]),)

    def observation(self, state: PendulumState) -> np.ndarray:
        return np.array([math.cos(state.angle), math.sin(state.angle), state.rate], np.float32)

    def is_terminal(self, state: PendulumState) -> bool:
        return abs(state.angle) > 2.0

    def reward(self, state: PendulumState) -> float:
        return math.cos(state.angle)


class OtherRods:
    """Draws a mass, a length and a friction of the hinge."""

    def draw(self, rng: np.random.Generator) -> tuple[Variation, np.ndarray]:
        mass, length, friction = rng.uniform([0.5, 0.8, 0.0], [1.5, 1.2, 0.05]).tolist()
        drawn = Variation({"rod": LinkScale(mass, length)}, {"hinge": friction})
        return drawn, np.array([mass, length, friction])


def make_pendulum(
    backend: str = "bullet",
    control_period: float | None = 0.01,
    engine: str = "bullet",
    varied: bool = False,
    **sensor: Any,
) -> RobotEnv[PendulumState]:
    """The pendulum as an environment."""
    return RobotEnv(
        make_backend(PENDULUM, backend, control_period, engine=engine),
        Upright(),
        control_period=control_period or 0.01,
        sensor=Sensor(PENDULUM, **sensor) if sensor else None,
        randomisation=OtherRods() if varied else None,
    )
