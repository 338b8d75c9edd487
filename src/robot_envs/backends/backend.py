"""What an environment needs of a world, be it simulated here, over ROS, or real."""

from collections.abc import Sequence
from typing import Protocol

from bullet_gazebo.physics.pose import Pose
from robot_envs.scene import Scene
from robot_envs.variation import Variation
from robot_envs.world_state import Commands, InitialState, StateQuery, WorldState

PHYSICS_STEP = 0.001  # [s]; Gazebo's, and of a world in this process


class RobotBackend(Protocol):
    """Moves the robots of a scene, whose controllers follow commands."""

    scene: Scene
    deterministic: bool  # whether the same commands give the same states
    shared: bool  # whether all backends of its kind in a process move the same robots

    def look(self, query: StateQuery) -> None:
        """Has states tell what a query names, beside the joints."""
        ...

    def reset(self, initial: InitialState) -> WorldState:
        """Begins an episode; returns the state reached.

        A backend that can't set velocities puts joints at rest, and says so in what it returns.
        `initial.commands` are the environment's to send.
        """
        ...

    def begin(self, commands: Commands) -> None:
        """Sends what `act` with the same commands is to wait for, and returns at once.

        `act` alone does the same; one in this process, or in real time, begins nothing. Whatever else is
        called before `act` takes the answer first; a reset drops it.
        """
        ...

    def act(self, commands: Commands) -> WorldState:
        """Commands controllers, with plain numbers; returns the state one control period later."""
        ...

    def vary(self, variation: Variation) -> None:
        """Gives robots and world other figures, see `Variation`; to be called before a reset."""
        ...

    def poses(self, links: Sequence[str]) -> list[Pose]:
        """Where the frames of links are, each named model::link, in the world."""
        ...

    def close(self) -> None:
        """Gives back what the backend holds; may be called twice."""
        ...


def ticks_per_action(control_period: float, physics_step: float) -> int:
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
