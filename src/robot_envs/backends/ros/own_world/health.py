"""Whether a simulator's answer can be."""

import math

from bullet_gazebo.simulator import NANOSECONDS
from robot_envs.errors import SimulatorFault
from robot_envs.world_state import WorldState

BEYOND = 1e9  # [rad, m, rad/s, m/s, N m, N]; no joint of a world of metres and seconds gets there


def check(state: WorldState, expected: int) -> None:
    """Makes sure that a state is finite, within bounds, and of the time that was asked for.

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
    for name, joint in state.joints.items():
        if not all(-BEYOND < each < BEYOND for each in joint):  # NaN, too
            what = "out of all bounds" if all(map(math.isfinite, joint)) else "not finite"
            position, velocity, effort = joint
            raise SimulatorFault(
                f"the joint '{name}' is {what}: position {position:g}, velocity {velocity:g}, "
                f"effort {effort:g}"
            )
