"""Whether a simulator's answer can be."""

import math

from bullet_gazebo.simulator import NANOSECONDS
from robot_envs.errors import SimulatorFault
from robot_envs.world_state import WorldState

BEYOND = 1e9  # [rad, m, rad/s, m/s, N m, N]; no joint of a world of metres and seconds gets there


def checked(state: WorldState, expected: int) -> WorldState:
    """Returns a state, once it is sure that it is finite, within bounds, and of the time that was asked for.

    Args:
        state: as the simulator tells it.
        expected: simulated time [ns] since the episode's begin.

    Raises:
        SimulatorFault: if it isn't.
    """
    if not math.isfinite(state.time) or round(state.time * NANOSECONDS) != expected:
        raise SimulatorFault(
            f"its time stands at {state.time:.9g} s of the episode, and {expected / NANOSECONDS:.9g} s were "
            "asked for"
        )
    for name, (position, velocity, effort) in state.joints.items():
        if not (
            -BEYOND < position < BEYOND
            and -BEYOND < velocity < BEYOND
            and -BEYOND < effort < BEYOND
        ):  # NaN, too
            finite = all(map(math.isfinite, (position, velocity, effort)))
            raise SimulatorFault(
                f"the joint '{name}' is {'out of all bounds' if finite else 'not finite'}: position "
                f"{position:g}, velocity {velocity:g}, effort {effort:g}"
            )
    return state
