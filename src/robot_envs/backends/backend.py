"""What an environment needs of a robot, be it simulated here, over ROS, or real."""

from collections.abc import Mapping
from typing import Protocol

from bullet_gazebo.physics.pose import Pose
from robot_envs.robot import Robot, State
from robot_envs.task import Command
from robot_envs.variation import Variation
from robot_envs.world_state import Motion, StateQuery, WorldState

PHYSICS_STEP = 0.001  # [s]; Gazebo's, and of a world in this process
DEFAULT_ENGINE = "bullet"


class RobotBackend(Protocol[State]):
    """Moves a robot whose controllers follow commands."""

    robot: Robot[State]
    deterministic: bool  # whether the same commands give the same states
    shared: bool  # whether all backends of its kind in a process move the same robot

    def reset(self, state: State, placed: Mapping[str, Motion] | None = None) -> State:
        """Puts the joints where the state says; returns the state reached.

        A backend that can't set velocities puts them at rest, and says so in what it returns.

        Args:
            state: of the robot.
            placed: models to put where they are wanted, in the world, by name; the others stand
                where they were spawned.
        """
        ...

    def act(self, command: Command) -> State:
        """Commands the controllers; returns the state one control period later."""
        ...

    def look(self, query: StateQuery) -> None:
        """Has `world` tell what a query names, beside the joints, from the next reset on."""
        ...

    def world(self) -> WorldState:
        """The world after the last reset or action; costs nothing where nobody asks for it."""
        ...

    def vary(self, variation: Variation) -> None:
        """Gives the robot other masses, lengths and friction; to be called before a reset."""
        ...

    def base(self) -> Pose:
        """Where the frame of the robot's root link is, in the world."""
        ...

    def close(self) -> None:
        """Gives back what the backend holds; may be called twice."""
        ...


def ticks_per_action(control_period: float | None, physics_step: float) -> int:
    """How many physics steps make one control period, both in [s].

    Raises:
        ValueError: if the period is None, or isn't a whole number of steps.
    """
    if control_period is None:
        raise ValueError("a control period is needed; only a world in real time goes without one")
    ratio = control_period / physics_step
    ticks = round(ratio) if 0.0 < ratio < 1e6 else 0  # also for NaN
    if ticks < 1 or abs(ticks * physics_step - control_period) > 1e-9:
        raise ValueError(
            f"control period {control_period} s is no multiple of the physics step {physics_step} s"
        )
    return ticks
