"""A robot's state in a joint-state message."""

import math

from sensor_msgs.msg import JointState

from robot_envs.errors import SimulatorError
from robot_envs.robot import Robot, State


def read_state(robot: Robot[State], message: JointState) -> State:
    """The robot's joints, as its tasks see them.

    Raises:
        SimulatorError: if a joint is missing or a value isn't finite.
    """
    numbers: list[float] = []
    try:
        for joint in robot.joints:
            index = message.name.index(joint)
            numbers += (message.position[index], message.velocity[index])
    except (ValueError, IndexError):
        raise SimulatorError(
            f"the joint state lacks {' or '.join(robot.joints)}; it has: {list(message.name)}"
        ) from None
    state = robot.state_of(numbers)
    if not math.isfinite(sum(numbers)):
        raise SimulatorError(f"the joint state isn't finite: {state}")
    return state
