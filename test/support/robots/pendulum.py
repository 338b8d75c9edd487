"""A robot as a user would bring one: its description, a task, an environment."""

import math
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from robot_envs import Commands, InitialState, Robot, RobotEnv, Task, WorldState
from robot_envs.variation import LinkScale, Variation

FILES = Path(__file__).resolve().parents[2] / "data" / "robots"
STRONGEST = 0.5  # [N m]
MOTOR = "hinge_effort_controller"

PENDULUM = Robot(urdf=FILES / "pendulum.urdf", controllers=FILES / "pendulum.yaml", run=(MOTOR,), world=None)


class Upright(Task):
    """The action is the motor's torque; the nearer to upright (0), the better."""

    max_steps = 200

    def __init__(self, noise: float = 0.05) -> None:
        self.noise = noise  # [rad], [rad/s]

    def action_space(self) -> gymnasium.spaces.Box:
        return gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def observation_space(self) -> gymnasium.spaces.Box:
        high = np.array([1.0, 1.0, np.finfo(np.float32).max], np.float32)
        return gymnasium.spaces.Box(-high, high)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        angle, rate = rng.uniform(-self.noise, self.noise, 2).tolist()
        return InitialState({"hinge": (angle, rate)})

    def apply(self, action: np.ndarray, state: WorldState) -> Commands:
        return {MOTOR: STRONGEST * float(action[0])}

    def observe(self, state: WorldState) -> np.ndarray:
        hinge = state.joints["hinge"]
        turned = [math.cos(hinge.position), math.sin(hinge.position), hinge.velocity]
        return np.array(turned, np.float32)

    def is_terminal(self, state: WorldState) -> bool:
        return abs(state.joints["hinge"].position) > 2.0

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        return math.cos(state.joints["hinge"].position)


class OtherRods:
    """Draws a mass, a length and a friction of the hinge."""

    def draw(self, rng: np.random.Generator) -> tuple[Variation, np.ndarray]:
        mass, length, friction = rng.uniform([0.5, 0.8, 0.0], [1.5, 1.2, 0.05]).tolist()
        drawn = Variation({"rod": LinkScale(mass, length)}, {"hinge": friction})
        return drawn, np.array([mass, length, friction])


def hanging(angle: float, rate: float = 0.0) -> InitialState:
    """An episode that begins with the hinge there [rad, rad/s]."""
    return InitialState({"hinge": (angle, rate)})


def make_pendulum(
    backend: str | None = None, robot: Robot = PENDULUM, varied: bool = False, **options: Any
) -> RobotEnv:
    """The pendulum as an environment."""
    randomisation = OtherRods() if varied else None
    return RobotEnv(robot, Upright(), backend, randomisation=randomisation, **options)
