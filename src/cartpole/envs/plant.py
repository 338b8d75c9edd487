"""What an environment needs of a robot, be it simulated here, over ROS, or real."""

from typing import Protocol

from cartpole.envs.variation import Variation
from cartpole.task import CartPoleState

CONTROL_PERIOD = 0.008  # [s] of simulated time for each action
PHYSICS_STEP = 0.001  # [s]
DEFAULT_ENGINE = "bullet"


class Plant(Protocol):
    """A cart-pole robot whose cart follows a position set-point."""

    deterministic: bool  # whether the same commands give the same states
    shared: bool  # whether all plants of its kind in a process move the same robot

    def reset(self, state: CartPoleState) -> CartPoleState:
        """Puts both joints where the state says; returns the state reached.

        A plant that can't set velocities puts them at rest, and says so in what it returns.
        """
        ...

    def act(self, set_point: float) -> CartPoleState:
        """Commands the cart to a set-point [m]; returns the state one control period later."""
        ...

    def vary(self, variation: Variation) -> None:
        """Gives the robot other masses, lengths and friction; to be called before a reset."""
        ...

    def close(self) -> None:
        """Gives back what the plant holds; may be called twice."""
        ...


def ticks_per_action(
    control_period: float = CONTROL_PERIOD, physics_step: float = PHYSICS_STEP
) -> int:
    """How many physics steps make one control period, both in [s].

    Raises:
        ValueError: if the period isn't a whole number of steps.
    """
    ratio = control_period / physics_step
    ticks = round(ratio) if 0.0 < ratio < 1e6 else 0  # also for NaN
    if ticks < 1 or abs(ticks * physics_step - control_period) > 1e-9:
        raise ValueError(
            f"control period {control_period} s is no multiple of the physics step {physics_step} s"
        )
    return ticks
